"""The command line: one module or package per subcommand, started by :func:`anisomesh.cli.main.run`.

Nothing heavy is imported before a subcommand runs, so that ``--help`` answers at once.
"""
