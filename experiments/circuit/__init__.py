"""The paper's experiments on the circuit plant: tables, figures, report, command."""
