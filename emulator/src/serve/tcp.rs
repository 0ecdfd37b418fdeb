//! An emulated sensor on a TCP port, as Ethernet models have: one client at a time.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::time::Instant;

use rustix::event::PollFlags;

use super::{Clock, Control, sleep};
use crate::urg::{LinkState, Urg};

/// Bytes kept for a client that does not read; a sensor has no more memory than that. Beyond it, the sensor drops
/// its scans and takes no requests.
const MAX_UNSENT: usize = 64 * 1024;

/// Serves the sensor until told to stop. Further clients are turned away while one is connected. The sensor's time
/// starts at 0 with this call.
///
/// # Errors
/// What the operating system says about the listening socket. Errors of a client end that client.
pub fn serve_tcp(listener: &TcpListener, mut sensor: Urg, control: &mut Control<'_>) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    let clock = Clock(Instant::now());
    let mut client: Option<Client> = None;
    while !control.stopped() {
        let now_us = clock.now_us();
        sensor.advance(now_us);
        if let Some(connected) = &mut client
            && (!connected.receive(&mut sensor, &clock) || sensor.link() == LinkState::Closed)
        {
            client = None;
            sensor.client_left(clock.now_us());
        }
        accept(listener, &mut client, &sensor)?;
        let sent = sensor.take_output(clock.now_us());
        if let Some(connected) = &mut client {
            sent.into_iter().for_each(|part| connected.unsent.extend(part.bytes));
            if !connected.send() {
                client = None;
                sensor.client_left(clock.now_us());
            }
        }
        sensor.set_reader_behind(client.as_ref().is_some_and(Client::is_behind));
        control.report(&sensor, client.is_some());
        let mut descriptors = vec![(listener.as_fd(), PollFlags::IN)];
        if sensor.link() == LinkState::Closed {
            descriptors.clear();
        }
        if let Some(connected) = &client {
            let send = if connected.unsent.is_empty() { PollFlags::empty() } else { PollFlags::OUT };
            let receive = if connected.is_behind() { PollFlags::empty() } else { PollFlags::IN };
            let flags = receive | send;
            descriptors.push((connected.stream.as_fd(), flags));
        }
        sleep(&descriptors, &sensor, &clock)?;
    }
    Ok(())
}

/// Accepts a client if there is none; a sensor that is off accepts none.
fn accept(listener: &TcpListener, client: &mut Option<Client>, sensor: &Urg) -> io::Result<()> {
    if sensor.link() == LinkState::Closed {
        return Ok(());
    }
    match listener.accept() {
        Ok((stream, _)) if client.is_none() => {
            // One that has gone again by now takes no settings on some systems.
            if stream.set_nonblocking(true).and_then(|()| stream.set_nodelay(true)).is_ok() {
                *client = Some(Client { stream, unsent: Vec::new() });
            }
            Ok(())
        }
        Ok(_) => Ok(()),
        Err(error) if is_passing(&error) => Ok(()),
        Err(error) => Err(error),
    }
}

/// Errors that say nothing about the listening socket: none is waiting, or the one waiting is gone again.
fn is_passing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::WouldBlock
            | ErrorKind::Interrupted
            | ErrorKind::ConnectionAborted
            | ErrorKind::ConnectionReset
    )
}

struct Client {
    stream: TcpStream,
    unsent: Vec<u8>,
}

impl Client {
    /// Hands what the client has sent to the sensor; false if the client is gone.
    fn receive(&mut self, sensor: &mut Urg, clock: &Clock) -> bool {
        if self.is_behind() {
            return true;
        }
        let mut buffer = [0; 1024];
        match self.stream.read(&mut buffer) {
            Ok(0) => false,
            Ok(count) => {
                sensor.receive(buffer.get(..count).unwrap_or_default(), clock.now_us());
                true
            }
            Err(error) => matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
        }
    }

    /// Whether it has to read before it is sent more.
    fn is_behind(&self) -> bool {
        self.unsent.len() >= MAX_UNSENT
    }

    /// Sends what the connection takes; false if the client is gone.
    fn send(&mut self) -> bool {
        if self.unsent.is_empty() {
            return true;
        }
        match self.stream.write(&self.unsent) {
            Ok(count) => {
                self.unsent.drain(..count.min(self.unsent.len()));
                true
            }
            Err(error) => matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
        }
    }
}
