"""The library of nine transfer functions: tables, figures, report, command."""
