"""Files of logs in every format that is read, and which format a file is in."""
