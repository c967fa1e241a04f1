"""The study of nine conditions: tables, figures, report, command."""
