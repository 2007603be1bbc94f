//! Pages for a browser on this host: read only, over HTTP/1.1 on loopback.
//!
//! A port of loopback is open to every user of the host, and to every page that a browser on it shows. So a reader needs the address with
//! its secret of 128 random bits; the `Host` of the request has to be the numeric address, since another name may resolve to it; and no page of
//! another origin may embed or read the pages. No request has a side effect. Page content is left to the caller.

use std::convert::Infallible;
use std::io;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderValue};
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use ring::rand::{SecureRandom, SystemRandom};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, oneshot};

use crate::loopback::LoopbackAddr;

/// Connections at once, at most; further ones are closed. A browser opens up to six.
const CONNECTIONS: usize = 32;
/// Time limit for the head of a request.
const HEAD: Duration = Duration::from_secs(5);
/// Time after which any connection ends; a browser opens another.
const LIFE: Duration = Duration::from_secs(60);
/// Longest head of a request, bytes, and most lines in it.
const MAX_HEAD: (usize, usize) = (16 * 1024, 64);
/// Pages run their own scripts and styles, connect to their own address, and to no other.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A page that can be requested.
pub struct Page {
    /// Its path below the address; empty for the address itself.
    pub path: &'static str,
    /// Its media type.
    pub media: &'static str,
    /// Its content.
    pub content: Content,
}

/// Content of a page.
pub enum Content {
    /// Fixed content.
    Fixed(&'static str),
    /// Content that is made for each request.
    Made(Box<dyn Fn() -> String + Send + Sync>),
}

/// Pages that are served until this is dropped.
pub struct Served {
    address: LoopbackAddr,
    secret: String,
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    /// Serves `pages` on a port of loopback; 0 lets the kernel choose.
    ///
    /// # Errors
    /// When the port is taken, or there is no randomness.
    pub fn open(port: u16, pages: Vec<Page>) -> io::Result<Self> {
        let listener = std::net::TcpListener::bind(LoopbackAddr::on_port(port).socket())?;
        listener.set_nonblocking(true)?;
        let address = LoopbackAddr::try_from(listener.local_addr()?).map_err(io::Error::other)?;
        let mut random = [0; 16];
        SystemRandom::new().fill(&mut random).map_err(|_| io::Error::other("no randomness for the page's address"))?;
        let secret: String = random.iter().map(|byte| format!("{byte:02x}")).collect();
        let site = Arc::new(Site { host: address.to_string(), secret, pages });
        let secret = site.secret.clone();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (end, ended) = oneshot::channel();
        let serve = move || {
            runtime.block_on(async {
                tokio::select! {
                    () = listen(listener, site) => {}
                    _ = ended => {}
                }
            });
        };
        let thread = std::thread::Builder::new().name("web".into()).spawn(serve)?;
        Ok(Self { address, secret, end: Some(end), thread: Some(thread) })
    }

    /// Address for a browser.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.address, self.secret)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::warn!("the thread that serves pages panicked");
        }
    }
}

struct Site {
    /// Required `Host` of a request.
    host: String,
    secret: String,
    pages: Vec<Page>,
}

async fn listen(listener: std::net::TcpListener, site: Arc<Site>) {
    let listener = match TcpListener::from_std(listener) {
        Ok(listener) => listener,
        Err(error) => return tracing::warn!(%error, "pages are not served"),
    };
    let room = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            // Out of descriptors, or the peer has closed already: the pause keeps it from a busy loop.
            Err(_) => {
                tokio::time::sleep(Duration::from_millis(50)).await;
                continue;
            }
        };
        let Ok(place) = Arc::clone(&room).try_acquire_owned() else { continue };
        let site = Arc::clone(&site);
        tokio::spawn(async move {
            // Any outcome ends the connection; there is nobody to report it to.
            let _ = tokio::time::timeout(LIFE, attend(stream, site)).await;
            drop(place);
        });
    }
}

async fn attend(stream: TcpStream, site: Arc<Site>) -> hyper::Result<()> {
    let service = service_fn(move |request| {
        let answer = site.answer(&request);
        async { Ok::<_, Infallible>(answer) }
    });
    let mut connection = hyper::server::conn::http1::Builder::new();
    let (bytes, lines) = MAX_HEAD;
    connection.timer(TokioTimer::new()).header_read_timeout(HEAD).max_buf_size(bytes).max_headers(lines);
    connection.serve_connection(TokioIo::new(stream), service).await
}

impl Site {
    fn answer(&self, request: &Request<Incoming>) -> Response<Full<Bytes>> {
        let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok());
        if host != Some(self.host.as_str()) {
            return plain(StatusCode::MISDIRECTED_REQUEST, "asked for under another name");
        }
        let below = request.uri().path().strip_prefix('/').and_then(|path| path.strip_prefix(&self.secret));
        let Some(page) = below.and_then(|path| path.strip_prefix('/')).and_then(|path| self.page(path)) else {
            return plain(StatusCode::NOT_FOUND, "no such page: take the whole address that was printed");
        };
        if request.method() != Method::GET {
            return plain(StatusCode::METHOD_NOT_ALLOWED, "these pages can only be read");
        }
        let content = match &page.content {
            Content::Fixed(text) => Bytes::from_static(text.as_bytes()),
            Content::Made(make) => Bytes::from(make()),
        };
        response(StatusCode::OK, page.media, content)
    }

    fn page(&self, path: &str) -> Option<&Page> {
        self.pages.iter().find(|page| page.path == path)
    }
}

fn plain(status: StatusCode, reason: &'static str) -> Response<Full<Bytes>> {
    response(status, "text/plain; charset=utf-8", Bytes::from_static(reason.as_bytes()))
}

fn response(status: StatusCode, media: &'static str, content: Bytes) -> Response<Full<Bytes>> {
    let mut response = Response::new(Full::new(content));
    *response.status_mut() = status;
    for (name, value) in [
        (header::CONTENT_TYPE, media),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (header::HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}
