"""Built-in random inputs."""
