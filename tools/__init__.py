"""Programs for those who build Quaymark; none of them is installed or needed at run time."""
