"""The piezo-stack actuator's study: tables, figures, report, command."""
