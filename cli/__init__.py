"""Words typed in a shell become function calls; a file per subcommand and what they share, no mathematics."""
