"""The editor without its terminal: the sheet, its selection, views, clipboard, search and journal. It knows no Textual."""
