//! The page on confinement shows the table of rights that services are held to.

use sandbox::table::{Log, Network, Read, ServiceRights, Write, rows};

use super::root;

const PAGE: &str = "docs/reviewer/confinement.md";
const BEGIN: &str = "by `HOLDSAFE_RENEW=1 cargo test --test tidy` -->\n";
const END: &str = "<!-- end -->";

#[test]
fn confinement_page_has_the_table_of_rights() {
    let read = || std::fs::read_to_string(root().join(PAGE)).expect("the page");
    let page = read();
    let (before, rest) = page.split_once(BEGIN).expect("the page has the table's begin");
    let (_, after) = rest.split_once(END).expect("and its end");
    let made = format!("{before}{BEGIN}{}{END}{after}", table());
    if std::env::var_os("HOLDSAFE_RENEW").is_some() {
        std::fs::write(root().join(PAGE), &made).expect("it can be written");
    }
    assert!(
        read() == made,
        "{PAGE} is not what the table of rights gives: run `HOLDSAFE_RENEW=1 cargo test --test tidy`"
    );
}

fn table() -> String {
    let head = "| service | reads | writes | bus | log | network | MiB | descriptors | file MiB |\n|---|---|---|---|---|---|---|---|---|\n";
    rows().iter().fold(head.to_owned(), |table, (service, row)| table + &line(service, row))
}

fn line(service: &str, row: &ServiceRights) -> String {
    let ServiceRights { read, write, bus, log, network, memory_mib, descriptors, file_mib } = row;
    let words = |words: Vec<&'static str>| if words.is_empty() { "-".to_owned() } else { words.join(", ") };
    let reads = words(read.iter().map(|right| reads(*right)).collect());
    let writes = words(write.iter().map(|right| writes(*right)).collect());
    let network = words(network.iter().map(|right| uses(*right)).collect());
    let log = match log {
        Some(Log::Sends) => "sends",
        Some(Log::Receives) => "receives",
        None => "-",
    };
    let bus = if *bus { "yes" } else { "-" };
    format!(
        "| {service} | {reads} | {writes} | {bus} | {log} | {network} | {memory_mib} | {descriptors} | {file_mib} |\n"
    )
}

fn reads(read: Read) -> &'static str {
    match read {
        Read::Model => "model",
        Read::Libraries => "libraries",
        Read::Processor => "processor",
        Read::Counters => "counters",
    }
}

fn writes(write: Write) -> &'static str {
    match write {
        Write::Journal => "journal",
        Write::Witness => "witness",
        Write::Recording => "recording",
    }
}

fn uses(network: Network) -> &'static str {
    match network {
        Network::Udp => "udp",
        Network::TcpListens => "tcp-listens",
        Network::TcpConnects => "tcp-connects",
    }
}
