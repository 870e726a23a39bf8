"""Materials: files beside mesh files, and from format to format."""
