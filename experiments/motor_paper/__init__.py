"""The diaphragm motor's paper checked number by number: tables, figures, report, command."""
