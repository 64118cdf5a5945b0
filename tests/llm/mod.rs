//! Live language models, against a server in this process on 127.0.0.1; nothing else is ever called.

mod client;
mod command;
mod prompts;
mod server;
mod subgoals;
