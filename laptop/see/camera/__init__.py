"""Pictures come in: from webcams, films, streams and folders, each with its time."""
