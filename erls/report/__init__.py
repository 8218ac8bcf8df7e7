"""What commands print: tables and summaries as plain text."""
