//! The serial line to the sensor: received by DMA into a ring, sent by DMA.

use core::future::poll_fn;
use core::pin::pin;

use embassy_stm32::mode::Async;
use embassy_stm32::usart::{Error, RingBufferedUartRx, UartTx};
use embedded_io_async::{ErrorType, Read, Write};
use kehai::link::Baud;

/// Both directions of the line, as one.
pub struct Uart {
    transmitter: UartTx<'static, Async>,
    receiver: RingBufferedUartRx<'static>,
}

impl Uart {
    /// Joins the two directions and starts receiving.
    pub fn new(transmitter: UartTx<'static, Async>, mut receiver: RingBufferedUartRx<'static>) -> Self {
        receiver.start_uart();
        Self { transmitter, receiver }
    }
}

impl ErrorType for Uart {
    type Error = Error;
}

impl Read for Uart {
    /// # Errors
    /// A line error or an overrun: bytes are lost, and reception has begun anew.
    ///
    /// # Cancellation
    /// Nothing is lost.
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        let read = self.receiver.read(buffer).await;
        if read.is_err() {
            // The error has stopped reception, and the next read starts it only if no other error has come
            // until then. On a busy line one has: bytes that nothing takes are an overrun.
            self.receiver.start_uart();
        }
        read
    }
}

impl Write for Uart {
    /// # Cancellation
    /// Some of the bytes may have been sent.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Error> {
        self.transmitter.write(bytes).await?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> impl Future<Output = Result<(), Error>> {
        self.transmitter.flush()
    }
}

impl Baud for Uart {
    // Not an `async fn`: each of those can panic once it is over. A flush that is begun anew waits for the
    // same end.
    fn set_baud(&mut self, rate_baud: u32) -> impl Future<Output = ()> {
        poll_fn(move |context| {
            let flushed = pin!(self.transmitter.flush()).poll(context);
            flushed.map(|flushed| {
                if flushed.is_err() || self.transmitter.set_baudrate(rate_baud).is_err() {
                    defmt::warn!("uart: {=u32} baud is out of reach", rate_baud);
                }
            })
        })
    }
}
