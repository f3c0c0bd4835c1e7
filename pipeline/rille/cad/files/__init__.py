"""Files of CAD programs and scripts: read in a child process, kept in a cache keyed by content."""
