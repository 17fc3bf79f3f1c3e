"""Fits beyond normal incidence: stacks that approximate a table of reflectance over angles."""
