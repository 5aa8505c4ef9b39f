"""Tables inside tables: an asset cell `@other_table` refers to the rows of that table.

Such a table is compiled flat: `contextdb.tables.nesting.flat` puts the inner rows in the place of the row that stands for them, and
each flat row keeps its way (`contextdb.compiled.ways`). `contextdb.tables.nesting.names` reads what an asset cell says.
"""
