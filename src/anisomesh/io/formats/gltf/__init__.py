"""Binary glTF (GLB)."""
