"""The job file and the recipe: TOML to frozen values in mm, every problem with its place."""
