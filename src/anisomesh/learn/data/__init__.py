"""Data sets of meshes with their metric, for training and validation.

``recipe`` has the options of a data set, ``sources`` its shapes, ``items`` the file format of an item. ``make`` makes
items from a shape, ``build`` a data set in parallel, ``manifest`` reads its list, ``examples`` makes training examples.
``remesher`` declares the remesher that is passed in; ``retriangulate`` gives a shape other triangles with it.
"""
