"""Identification: statistics, public sets, peers, bent inputs, state space, frequency response, own equations."""
