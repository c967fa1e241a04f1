"""The diaphragm motor's study: tables, figures, report, command."""
