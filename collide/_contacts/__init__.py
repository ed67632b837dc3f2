"""A ball state: the grid, the search for what touches, and contacts resolved in their order."""
