"""Public data sets as logs: each importer reads the files as they are published and writes what a robot would log.

What a method must not see (ids, barcodes, the truth) stands on topics under ``/ground_truth``. An importer is a
function ``convert_x(source, out_path, **options)`` that returns an ``Imported``; ``conversions.py`` lists them.
"""
