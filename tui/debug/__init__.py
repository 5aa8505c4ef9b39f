"""The debugger of recorded sessions: `contextdb motion debug`."""
