//! An HTTP server that follows a script: one connection after the other, one reply each.
//!
//! Replies come in; an address goes out, and what was asked. Imports nothing but the standard library.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};

/// What the server does with one request.
#[derive(Clone)]
pub enum Reply {
    /// A status, more header lines, and a body.
    Full(u16, &'static str, String),
    /// The beginning of a body that is promised to be longer.
    BrokenOff(&'static str),
    /// Nothing, for this long.
    Silence(Duration),
    /// Closes the connection at once.
    HangUp,
}

/// A request as it came in.
#[derive(Clone, Debug)]
pub struct Asked {
    pub path: String,
    /// Header lines, names in lower case.
    pub headers: Vec<(String, String)>,
    pub body: Value,
}

impl Asked {
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }
}

pub struct Server {
    pub url: String,
    asked: Arc<Mutex<Vec<Asked>>>,
}

impl Server {
    /// Starts a server for these replies. Requests beyond them get the last one again.
    pub fn start(replies: Vec<Reply>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let asked = Arc::new(Mutex::new(Vec::new()));
        let seen = Arc::clone(&asked);
        // Ends with the test's process.
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let Some(request) = read(&stream) else { continue };
                let number = {
                    let mut seen = seen.lock().unwrap();
                    seen.push(request);
                    seen.len() - 1
                };
                let reply = replies[number.min(replies.len() - 1)].clone();
                // A silent connection must not keep the next one waiting.
                thread::spawn(move || answer(stream, reply));
            }
        });
        Self { url, asked }
    }

    /// What was asked so far.
    pub fn asked(&self) -> Vec<Asked> {
        self.asked.lock().unwrap().clone()
    }
}

fn read(stream: &TcpStream) -> Option<Asked> {
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    reader.read_line(&mut line).ok()?;
    let path = line.split(' ').nth(1)?.to_owned();
    let mut headers = Vec::new();
    loop {
        line.clear();
        reader.read_line(&mut line).ok()?;
        let Some((name, value)) = line.trim_end().split_once(": ") else { break };
        headers.push((name.to_lowercase(), value.to_owned()));
    }
    let length = headers.iter().find(|(name, _)| name == "content-length")?.1.parse().ok()?;
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    Some(Asked { path, headers, body: serde_json::from_slice(&body).ok()? })
}

fn answer(mut stream: TcpStream, reply: Reply) {
    let (status, more, body, length) = match reply {
        Reply::Full(status, more, body) => {
            let length = body.len();
            (status, more, body, length)
        }
        Reply::BrokenOff(body) => (200, "", body.to_owned(), body.len() + 100),
        Reply::Silence(time) => return thread::sleep(time),
        Reply::HangUp => return,
    };
    let head = format!(
        "HTTP/1.1 {status} Because\r\nContent-Type: application/json\r\nContent-Length: {length}\r\nConnection: close\r\n{more}\r\n"
    );
    // Whether somebody still listens is not the server's business.
    let _ = stream.write_all((head + &body).as_bytes());
}

/// A good answer in OpenAI's form.
pub fn chat(text: &str) -> Reply {
    let body = json!({"model": "served-model", "choices": [{"message": {"role": "assistant", "content": text},
        "finish_reason": "stop"}], "usage": {"prompt_tokens": 11, "completion_tokens": 22}});
    Reply::Full(200, "", body.to_string())
}

/// A good answer in Anthropic's form.
pub fn message(text: &str) -> Reply {
    let body = json!({"model": "served-model", "content": [{"type": "text", "text": text}],
        "stop_reason": "end_turn", "usage": {"input_tokens": 11, "output_tokens": 22}});
    Reply::Full(200, "", body.to_string())
}

/// An error with a message.
pub fn error(status: u16, more: &'static str, said: &str) -> Reply {
    Reply::Full(status, more, json!({"error": {"message": said}}).to_string())
}
