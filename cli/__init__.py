"""Words typed in a shell become function calls; one file per subcommand, no mathematics."""
