"""What stands on top of the library: command line, pages, data sets, laws, gallery, speed."""
