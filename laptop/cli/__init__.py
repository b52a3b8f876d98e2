"""The commands: what is typed becomes one call.  Only here is click known."""
