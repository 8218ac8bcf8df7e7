"""The modal model of a link, its file and its identities."""
