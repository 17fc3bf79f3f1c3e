"""A package, so that its fixtures of that scope end with its last test: no other may run beside Playwright's loop."""
