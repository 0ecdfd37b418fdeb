//! What is wrong with an installation, and what to do about it.
//!
//! ```text
//!   files, disk, sockets, tracker, broker, clock, systemd ─ gather ─▶ Facts ─ examine ─▶ findings: ok │ unknown │ warning │ wrong
//! ```
//!
//! | file | what |
//! |---|---|
//! | `facts` | what was found out; what could not be is said |
//! | `finding` | what follows from it |
//! | `files`, `network`, `machine` | from facts to findings, pure |
//! | `gather/` | asks the machine; changes nothing there, and decides nothing |

pub mod facts;
mod files;
pub mod finding;
pub mod gather;
mod machine;
mod network;

use facts::Facts;
use finding::Finding;

/// What follows from the facts, in the order in which an installation is built.
#[must_use]
pub fn examine(facts: &Facts) -> Vec<Finding> {
    let mut findings: Vec<Finding> = files::options(&facts.options).into_iter().collect();
    if facts.is_service {
        findings.push(machine::service(facts.service.as_ref()));
    }
    findings.extend(files::site(&facts.site, facts.map.is_some()));
    findings.extend(facts.secrets.iter().map(|secret| files::secret(secret, facts.map.as_ref())));
    findings.extend(files::database(facts.database.as_ref()));
    findings.extend(network::map(facts.map.as_ref(), facts.is_service));
    findings.push(network::buffer(&facts.udp, facts.modules()));
    findings.push(network::search(facts.search.as_ref(), facts.modules()));
    findings.extend(network::modules(&facts.site, &facts.devices));
    findings.extend(facts.broker.as_ref().map(network::broker));
    findings.push(machine::clock(facts.clock));
    findings
}

#[cfg(test)]
mod tests;
