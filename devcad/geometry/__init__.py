"""The geometry core: numbers in, values out; knows no file and no format."""
