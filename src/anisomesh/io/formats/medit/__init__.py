"""The files of MEDIT: meshes (.mesh, .meshb) and solutions (.sol, .solb)."""
