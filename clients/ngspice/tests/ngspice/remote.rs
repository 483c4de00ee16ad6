//! The same decks with the model on a server, and what happens when the server goes away.
