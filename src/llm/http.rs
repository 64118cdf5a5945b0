//! One question over HTTP: JSON is posted, JSON comes back; waits and tries again where that can help.
//!
//! An address, headers and a body come in; the answer's JSON goes out, or a [`ModelError`]. Tried again are lost
//! connections, answers that break off, and the statuses 408, 429 and 5xx; how long and how often is in
//! [`Patience`]. Redirects are not followed: they would carry a key to a server that nobody named. Imports `model`.

use std::error::Error;
use std::fmt;
use std::io::Read;
use std::time::{Duration, SystemTime};

use reqwest::blocking::{Client, Response};
use reqwest::header::{HeaderMap, HeaderName, HeaderValue, RETRY_AFTER};
use reqwest::{Url, redirect};
use serde_json::Value;

use super::model::ModelError;

/// No answer is read beyond this: a plan is a few kilobytes.
const MAX_BYTES: usize = 16 << 20;
/// Of what a server says about an error, this many characters are shown.
const SAID_CHARS: usize = 300;

/// How long and how often donut waits for a server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patience {
    /// For an answer, from the request to its last byte.
    pub answer: Duration,
    /// For a connection.
    pub connection: Duration,
    /// How often a request is sent at most.
    pub attempts: u32,
    /// Wait before the second attempt; doubled before each further one.
    pub first_wait: Duration,
    /// The longest wait that a server may ask for (`Retry-After`).
    pub longest_wait: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            answer: Duration::from_secs(600),
            connection: Duration::from_secs(10),
            attempts: 5,
            first_wait: Duration::from_secs(1),
            longest_wait: Duration::from_secs(120),
        }
    }
}

impl Patience {
    /// The wait after this attempt (from 1) where the server asks for none.
    fn back_off(&self, attempt: u32) -> Duration {
        self.first_wait.saturating_mul(1 << (attempt - 1).min(16)).min(self.longest_wait)
    }
}

/// A wait before another attempt.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pause {
    /// The attempt that failed, from 1, of this many.
    pub attempt: u32,
    pub attempts: u32,
    /// Why it failed.
    pub reason: String,
    /// How long to wait.
    pub wait: Duration,
}

/// Waits, and may tell somebody. [`sleep`] only waits.
pub type Waiter = Box<dyn FnMut(&Pause)>;

/// The waiter that tells nobody.
pub fn sleep() -> Waiter {
    Box::new(|pause| std::thread::sleep(pause.wait))
}

/// A key. Neither `Debug` nor an error shows it.
#[derive(Clone)]
pub struct Key(String);

impl Key {
    /// Wraps a key; blanks around it are not part of it.
    pub fn new(text: &str) -> Self {
        Self(text.trim().to_owned())
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(..)")
    }
}

/// One address, with what every request to it carries.
pub struct Http {
    client: Client,
    url: Url,
    headers: HeaderMap,
    key: Option<Key>,
    patience: Patience,
    waiter: Waiter,
}

/// A request that failed, and whether another may succeed.
struct Failure {
    error: Box<ModelError>,
    reason: String,
    again: bool,
    /// The wait that the server asks for.
    after: Option<Duration>,
}

impl Http {
    /// A client for one address. Nothing is sent yet.
    pub fn new(url: Url, patience: Patience, waiter: Waiter) -> Result<Self, ModelError> {
        // Fails where it has been done already, which is as well.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let mut builder = Client::builder()
            .user_agent(concat!("donut/", env!("CARGO_PKG_VERSION")))
            .redirect(redirect::Policy::none())
            .connect_timeout(patience.connection)
            .timeout(patience.answer);
        if url.scheme() == "http" {
            // Nothing is encrypted, so a machine without CA certificates will do.
            builder = builder.tls_certs_only([]);
        }
        if is_loopback(&url) {
            builder = builder.no_proxy();
        }
        let client = builder.build().map_err(|error| ModelError::Tls { reason: innermost(&error) })?;
        Ok(Self { client, url, headers: HeaderMap::new(), key: None, patience, waiter })
    }

    /// Adds a header to every request.
    pub fn header(mut self, name: &'static str, value: &'static str) -> Self {
        self.headers.insert(HeaderName::from_static(name), HeaderValue::from_static(value));
        self
    }

    /// Adds a key as the header `name`, behind `prefix`. `variable` is where it comes from.
    pub fn key(
        mut self,
        name: &'static str,
        prefix: &str,
        key: Key,
        variable: &'static str,
    ) -> Result<Self, ModelError> {
        let mut value = HeaderValue::from_str(&format!("{prefix}{}", key.0))
            .map_err(|_| ModelError::BadKey { variable })?;
        value.set_sensitive(true);
        self.headers.insert(HeaderName::from_static(name), value);
        self.key = Some(key);
        Ok(self)
    }

    /// The address as messages show it: without a query, which may be private.
    pub fn shown_url(&self) -> String {
        let mut url = self.url.clone();
        url.set_query(None);
        url.into()
    }

    /// Posts `body` until there is an answer or patience ends. `refused` makes the error of a status that no
    /// other attempt would change: it gets the status and what the server says.
    pub fn post(
        &mut self,
        body: &Value,
        refused: impl Fn(u16, String) -> ModelError,
    ) -> Result<Value, ModelError> {
        let attempts = self.patience.attempts.max(1);
        let mut attempt = 1;
        loop {
            let failure = match self.once(body, attempt, &refused) {
                Ok(answer) => return Ok(answer),
                Err(failure) => failure,
            };
            if !failure.again || attempt == attempts {
                return Err(*failure.error);
            }
            let wait = failure.after.unwrap_or_else(|| self.patience.back_off(attempt));
            if wait > self.patience.longest_wait {
                return Err(too_long_a_wait(*failure.error, wait));
            }
            (self.waiter)(&Pause { attempt, attempts, reason: failure.reason, wait });
            attempt += 1;
        }
    }

    fn once(
        &self,
        body: &Value,
        attempt: u32,
        refused: &impl Fn(u16, String) -> ModelError,
    ) -> Result<Value, Failure> {
        let request = self
            .client
            .post(self.url.clone())
            .headers(self.headers.clone())
            .header("content-type", "application/json")
            .body(body.to_string());
        let mut response = request.send().map_err(|error| self.lost(&error, error.is_connect(), attempt))?;
        let status = response.status();
        let after = retry_after(response.headers(), SystemTime::now());
        let bytes = self.read(&mut response, attempt);
        if status.is_success() {
            let bytes = bytes?;
            let json = self.parse(&bytes, attempt)?;
            // Some servers that pass questions on report others' errors like this.
            if json.get("error").is_some_and(|error| !error.is_null()) {
                return Err(Failure::last(refused(status.as_u16(), self.said(&bytes, &json))));
            }
            return Ok(json);
        }
        // What a server says about an error may break off: then that is all it says.
        let bytes = bytes.unwrap_or_default();
        let json = serde_json::from_slice(&bytes).unwrap_or(Value::Null);
        let said = self.said(&bytes, &json);
        let (url, status) = (self.shown_url(), status.as_u16());
        let reason = format!("status {status}: {said}");
        let used_up = json.pointer("/error/code").is_some_and(|code| code == "insufficient_quota");
        let error = match status {
            300..400 => ModelError::Redirected { url, status },
            429 if used_up => ModelError::QuotaUsedUp { url, status, said },
            408 | 429 | 500.. => {
                let error = ModelError::Busy { url, attempts: attempt, status, said };
                return Err(Failure { error: error.into(), reason, again: true, after });
            }
            _ => refused(status, said),
        };
        Err(Failure { error: error.into(), reason, again: false, after })
    }

    fn read(&self, response: &mut Response, attempt: u32) -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        match response.take(MAX_BYTES as u64 + 1).read_to_end(&mut bytes) {
            Ok(_) if bytes.len() > MAX_BYTES => {
                Err(Failure::last(ModelError::TooLong { url: self.shown_url(), limit: MAX_BYTES }))
            }
            Ok(_) => Ok(bytes),
            Err(error) if is_timeout(&error) => Err(self.timed_out()),
            Err(_) => Err(self.broken_off(bytes.len(), attempt)),
        }
    }

    fn parse(&self, bytes: &[u8], attempt: u32) -> Result<Value, Failure> {
        serde_json::from_slice(bytes).map_err(|error| {
            if error.is_eof() {
                return self.broken_off(bytes.len(), attempt);
            }
            let what = format!("it begins with `{}`", self.clean(&String::from_utf8_lossy(bytes), 60));
            Failure::last(ModelError::UnknownForm { url: self.shown_url(), what })
        })
    }

    fn lost(&self, error: &reqwest::Error, connecting: bool, attempt: u32) -> Failure {
        if error.is_timeout() && !connecting {
            return self.timed_out();
        }
        let reason = if error.is_timeout() {
            format!("no connection within {} s", self.patience.connection.as_secs())
        } else {
            innermost(error)
        };
        let error =
            ModelError::Unreachable { url: self.shown_url(), attempts: attempt, reason: reason.clone() };
        Failure { error: error.into(), reason, again: true, after: None }
    }

    /// A server that takes too long once will do so again: there is no other attempt.
    fn timed_out(&self) -> Failure {
        let seconds = self.patience.answer.as_secs();
        Failure::last(ModelError::TimedOut { url: self.shown_url(), seconds })
    }

    fn broken_off(&self, bytes: usize, attempt: u32) -> Failure {
        let error = ModelError::BrokenOff { url: self.shown_url(), attempts: attempt, bytes };
        let reason = format!("the answer breaks off after {bytes} bytes");
        Failure { error: error.into(), reason, again: true, after: None }
    }

    /// What a server says about an error, in one line.
    fn said(&self, bytes: &[u8], json: &Value) -> String {
        let found = ["/error/message", "/error", "/message", "/detail"].into_iter();
        let message = found.filter_map(|place| json.pointer(place)?.as_str()).next();
        let whole = String::from_utf8_lossy(bytes);
        match self.clean(message.unwrap_or(&whole), SAID_CHARS) {
            empty if empty.is_empty() => "it says nothing more".to_owned(),
            said => said,
        }
    }

    /// A server's text in one line of at most `limit` characters, without control characters, which a terminal
    /// would obey, and without the key, which some servers repeat.
    pub fn clean(&self, text: &str, limit: usize) -> String {
        let mut text = text.to_owned();
        if let Some(Key(key)) = self.key.as_ref().filter(|key| !key.0.is_empty()) {
            text = text.replace(key, "[key]");
        }
        let words: Vec<&str> = text.split(|c: char| c.is_whitespace() || c.is_control()).collect();
        let line = words.into_iter().filter(|w| !w.is_empty()).collect::<Vec<_>>().join(" ");
        match line.char_indices().nth(limit) {
            Some((end, _)) => format!("{} ..", &line[..end]),
            None => line,
        }
    }
}

impl Failure {
    fn last(error: ModelError) -> Self {
        Self { reason: error.to_string(), error: error.into(), again: false, after: None }
    }
}

fn too_long_a_wait(error: ModelError, wait: Duration) -> ModelError {
    match error {
        ModelError::Busy { url, status, said, .. } => {
            ModelError::WaitTooLong { url, seconds: wait.as_secs(), status, said }
        }
        other => other,
    }
}

/// The wait that a `Retry-After` asks for, in seconds or until a date (RFC 9110, 10.2.3).
fn retry_after(headers: &HeaderMap, now: SystemTime) -> Option<Duration> {
    let text = headers.get(RETRY_AFTER)?.to_str().ok()?.trim();
    if let Ok(seconds) = text.parse() {
        return Some(Duration::from_secs(seconds));
    }
    let date = httpdate::parse_http_date(text).ok()?;
    Some(date.duration_since(now).unwrap_or_default())
}

/// Whether the address is this machine's own, to which no proxy leads.
fn is_loopback(url: &Url) -> bool {
    let host = url.host_str().unwrap_or("").trim_matches(['[', ']']);
    host == "localhost" || host.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback())
}

/// The cause at the end of the chain: those before it only say that something could not be done.
fn innermost(error: &dyn Error) -> String {
    let mut last = error;
    while let Some(cause) = last.source() {
        last = cause;
    }
    last.to_string()
}

fn is_timeout(error: &std::io::Error) -> bool {
    let inner = error.get_ref().and_then(|e| e.downcast_ref::<reqwest::Error>());
    error.kind() == std::io::ErrorKind::TimedOut || inner.is_some_and(reqwest::Error::is_timeout)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_the_longest() {
        let waits: Vec<u64> = (1..=9).map(|a| Patience::default().back_off(a).as_secs()).collect();
        assert_eq!(waits, [1, 2, 4, 8, 16, 32, 64, 120, 120]);
        assert_eq!(Patience::default().back_off(u32::MAX).as_secs(), 120);
    }

    #[test]
    fn retry_after_in_seconds_or_until_a_date() {
        let now = httpdate::parse_http_date("Sun, 06 Nov 1994 08:49:37 GMT").unwrap();
        let after = |text: &'static str| {
            let headers = HeaderMap::from_iter([(RETRY_AFTER, HeaderValue::from_static(text))]);
            retry_after(&headers, now).map(|wait| wait.as_secs())
        };
        assert_eq!(after("7"), Some(7));
        assert_eq!(after("Sun, 06 Nov 1994 08:50:07 GMT"), Some(30));
        assert_eq!(after("Sunday, 06-Nov-94 08:50:07 GMT"), Some(30));
        assert_eq!(after("Sun, 06 Nov 1994 08:00:00 GMT"), Some(0), "a date that has passed");
        assert_eq!(after("soon"), None);
        assert_eq!(retry_after(&HeaderMap::new(), now), None);
    }

    #[test]
    fn what_a_server_says_is_one_line_without_the_key() {
        let url = Url::parse("http://127.0.0.1:9/v1?private=1").unwrap();
        let http = Http::new(url, Patience::default(), sleep()).unwrap();
        let http = http.key("authorization", "Bearer ", Key::new(" sk-1 \n"), "KEY").unwrap();
        assert_eq!(http.clean("bad \u{1b}[31mkey\r\n\tsk-1!", 50), "bad [31mkey [key]!");
        assert_eq!(http.clean("four", 3), "fou ..");
        assert_eq!(http.shown_url(), "http://127.0.0.1:9/v1");
        assert_eq!(format!("{:?}", http.key), "Some(Key(..))");
    }
}
