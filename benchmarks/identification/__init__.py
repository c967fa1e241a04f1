"""Identification: statistics, public sets, peers, nonlinear inputs, state space, frequency response, own equations."""
