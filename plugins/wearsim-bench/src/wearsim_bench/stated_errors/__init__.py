"""Study of stated errors against true ones."""
