"""The screens: that of the sheet, and the dialogs that open over it."""
