//! Pages for a browser: authorised readers, and answers to other requests.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};

use link::web::{Content, Page, Served};

fn served() -> Served {
    let requests = std::sync::atomic::AtomicU32::new(0);
    let count = move || requests.fetch_add(1, std::sync::atomic::Ordering::Relaxed).to_string();
    let html = Page { path: "", media: "text/html; charset=utf-8", content: Content::Fixed("<p>here") };
    let made = Page { path: "count", media: "application/json", content: Content::Made(Box::new(count)) };
    Served::open(0, vec![html, made]).expect("a port of loopback")
}

/// Host and path of the pages.
fn parts(served: &Served) -> (String, String) {
    let address = served.address();
    let (host, path) = address.strip_prefix("http://").unwrap().split_once('/').unwrap();
    (host.to_owned(), format!("/{path}"))
}

fn connect(served: &Served) -> TcpStream {
    TcpStream::connect(parts(served).0).unwrap()
}

/// The answer to a request, after which the stream ends.
fn answer(served: &Served, request: &str) -> String {
    read(sent(served, request))
}

/// A connection on which this was sent. Who is turned away may find it closed already.
fn sent(served: &Served, bytes: &str) -> TcpStream {
    let mut stream = connect(served);
    let _ = stream.write_all(bytes.as_bytes());
    stream
}

fn read(mut stream: TcpStream) -> String {
    let mut text = String::new();
    let _ = stream.read_to_string(&mut text);
    text
}

fn get(served: &Served, host: &str, path: &str) -> String {
    answer(served, &format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"))
}

#[test]
fn pages_need_the_address_and_are_made_anew() {
    let served = served();
    let (host, path) = parts(&served);
    let page = get(&served, &host, &path);
    assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("<p>here"), "{page}");
    for says in ["content-security-policy: default-src 'none'", "nosniff", "no-store", "resource-policy: same-origin"] {
        assert!(page.contains(says), "{says}: {page}");
    }
    let count = || get(&served, &host, &format!("{path}count"));
    assert!(count().ends_with("\r\n\r\n0") && count().ends_with("\r\n\r\n1"));
}

/// Nor do requests under another name, or those that would change something.
#[test]
fn requests_without_secret_or_name_get_no_page() {
    let served = served();
    let (host, path) = parts(&served);
    let mut guess = path.clone();
    guess.replace_range(1..2, if path.starts_with("/0") { "1" } else { "0" });
    for other in ["/", &guess, &path[..path.len() - 1], &format!("{path}nothing"), &format!("{path}../"), "//"] {
        assert!(get(&served, &host, other).starts_with("HTTP/1.1 404"), "{other}");
    }
    let port = host.rsplit_once(':').unwrap().1;
    for name in [format!("localhost:{port}"), format!("attacker.example:{port}"), "127.0.0.1".to_owned()] {
        assert!(get(&served, &name, &path).starts_with("HTTP/1.1 421"), "{name}");
    }
    let unnamed = answer(&served, &format!("GET {path} HTTP/1.0\r\n\r\n"));
    assert!(unnamed.starts_with("HTTP/1.0 421"), "{unnamed}");
    let post = format!("POST {path} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 2\r\nConnection: close\r\n\r\nhi");
    assert!(answer(&served, &post).starts_with("HTTP/1.1 405"));
}

/// They are refused, and the next one is served.
#[test]
fn malformed_or_long_requests_do_not_block() {
    let served = served();
    let (host, path) = parts(&served);
    let long = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nX: {}\r\n\r\n", "x".repeat(64 * 1024));
    let many = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{}\r\n", "X: y\r\n".repeat(200));
    for hostile in [long.as_str(), many.as_str(), "\0\0\0\0\r\n\r\n", "\r\n", "GET", ""] {
        // Nothing more will come, so that nobody waits for the rest of it.
        let stream = sent(&served, hostile);
        let _ = stream.shutdown(Shutdown::Write);
        let text = read(stream);
        assert!(!text.contains(" 200 "), "{text}");
    }
    assert!(get(&served, &host, &path).starts_with("HTTP/1.1 200"));
}

/// The end of the server ends them all.
#[test]
fn many_silent_connections_are_turned_away() {
    let served = served();
    let (host, path) = parts(&served);
    let mut idle: Vec<TcpStream> = (0..40).map(|_| connect(&served)).collect();
    // Connections beyond the limit are closed at once: a read of the last one ends.
    assert_eq!(idle[39].read(&mut [0]).unwrap_or(0), 0);
    assert!(!get(&served, &host, &path).starts_with("HTTP/1.1 200"), "there was room");
    drop(idle.split_off(8));
    // A place is free as soon as the server has seen the connection close.
    while !get(&served, &host, &path).starts_with("HTTP/1.1 200") {}
    drop(served);
    assert_eq!(idle[0].read(&mut [0]).unwrap_or(0), 0);
    assert!(TcpStream::connect(host).is_err());
}
