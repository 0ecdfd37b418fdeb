//! One request to the tracker's server, and its answer, whatever the status.
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::net::SocketAddr;

use ureq::Agent;
use ureq::http::{HeaderMap, Request};

/// Status and body of the answer to a request, as `GET /api/state`, with headers by name.
pub fn ask(server: SocketAddr, line: &str, headers: &[(&str, &str)], body: &[u8]) -> (u16, String) {
    let (status, _, body) = exchange(server, line, headers, body);
    (status, body)
}

/// The same, and the answer's headers.
pub fn exchange(
    server: SocketAddr,
    line: &str,
    headers: &[(&str, &str)],
    body: &[u8],
) -> (u16, HeaderMap, String) {
    let (method, path) = line.split_once(' ').unwrap();
    let mut request = Request::builder().method(method).uri(format!("http://{server}{path}"));
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    let agent: Agent = Agent::config_builder().http_status_as_error(false).proxy(None).build().into();
    let answer = if body.is_empty() && matches!(method, "GET" | "DELETE") {
        agent.run(request.body(()).unwrap())
    } else {
        agent.run(request.body(body).unwrap())
    };
    let mut answer = answer.unwrap_or_else(|error| panic!("no answer to {line}: {error}"));
    let text = answer.body_mut().read_to_string().unwrap();
    crate::described::answer(line, answer.status().as_u16(), &text);
    let is_toml = headers.iter().any(|(_, value)| *value == "application/toml");
    if answer.status().is_success() && method != "GET" && !is_toml {
        crate::described::asked(line, body);
    }
    (answer.status().as_u16(), answer.headers().clone(), text)
}
