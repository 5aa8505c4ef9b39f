"""Tables from other programs and for them: CSV in every dialect, Excel, Parquet, JSON, Unreal, the clipboard.

    bytes ─► formats.read ─► Reading ─► mapping.propose ─► Plan ─► plan.table, plan.toml
    Table ─► formats.write ─► bytes

A Reading says how its file was understood; a Plan says which column becomes what, and why. Nothing here touches the disk but
`importing`, which the command and the editor call last.
"""
