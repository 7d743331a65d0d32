"""Content and files of the results of all studies: one HDF5 file, which opens after a kill."""
