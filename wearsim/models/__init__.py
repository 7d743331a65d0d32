"""The built-in contact models, wear laws and loads, registered through the same hooks as anyone's."""
