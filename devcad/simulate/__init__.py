"""Motion and forces: folded sheets as bars and hinges, linkages that lie in a cylinder."""
