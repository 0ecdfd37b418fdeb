//! The serial line to the sensor: from the 32-byte FIFO into a ring, by interrupt.

use embassy_rp::uart::{BufferedUart, Error};
use embassy_time::Timer;
use embedded_io_async::{ErrorType, Read, Write};
use kehai::link::Baud;

/// A byte at the lowest rate, 19200 baud, lasts 521 µs.
const LOOK_AGAIN_US: u64 = 100;

/// The line.
pub struct Uart(pub BufferedUart);

impl ErrorType for Uart {
    type Error = Error;
}

impl Read for Uart {
    /// # Errors
    /// A line error or an overrun: bytes are lost, and the next call receives again.
    ///
    /// # Cancellation
    /// Nothing is lost.
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        self.0.read(buffer).await
    }
}

impl Write for Uart {
    /// # Cancellation
    /// Nothing is sent.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Error> {
        self.0.write(bytes).await
    }

    async fn flush(&mut self) -> Result<(), Error> {
        self.0.flush().await
    }
}

impl Baud for Uart {
    async fn set_baud(&mut self, rate_baud: u32) {
        // Flushed is not yet sent: the FIFO and the shift register follow.
        let _ = self.0.flush().await;
        while self.0.busy() {
            Timer::after_micros(LOOK_AGAIN_US).await;
        }
        self.0.set_baudrate(rate_baud);
    }
}
