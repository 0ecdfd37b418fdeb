//! Images in flash beside the store: what is there is read, and what [`plan`](crate::update::plan) says is written.

use embedded_storage_async::nor_flash::NorFlash;

use super::flash::FlashStore;
use crate::link::{Images, StoreError};
use crate::update::notes::{CANDIDATE_LEN, WORD_LEN};
use crate::update::plan::{ImageJob, Known, Operation, pages};
use crate::update::standing::Standing;

impl<F: NorFlash> Images for FlashStore<F> {
    async fn images(&mut self, job: ImageJob<'_>) -> Result<Standing, StoreError> {
        let Some((flash, slots)) = self.slots() else {
            let nothing = matches!(job, ImageJob::Look | ImageJob::Told);
            return if nothing { Ok(Standing::NO_BOOT_LOADER) } else { Err(StoreError) };
        };
        let mut known = Known::NOTHING;
        let mut word = [0; WORD_LEN];
        if !matches!(job, ImageJob::Write { .. }) {
            let (versions, page) = pages(slots);
            for at in versions.step_by(WORD_LEN) {
                flash.read(at, &mut word).await.map_err(|_| StoreError)?;
                if !known.least(at, &word) {
                    break;
                }
            }
            let mut candidate = [0; CANDIDATE_LEN];
            flash.read(page.start, &mut candidate).await.map_err(|_| StoreError)?;
            known.candidate(&candidate);
            let state = word.get_mut(..F::WRITE_SIZE).ok_or(StoreError)?;
            flash.read(slots.state.start, state).await.map_err(|_| StoreError)?;
            known.state(state);
        }
        let plan = known.plan(job, slots, (F::ERASE_SIZE, F::WRITE_SIZE)).map_err(|_| StoreError)?;
        for operation in plan.iter().flatten() {
            match operation {
                Operation::Erase(pages) => flash.erase(pages.start, pages.end).await,
                Operation::Write(at, bytes) => flash.write(*at, bytes).await,
                Operation::Mark(at, mark, len) => {
                    let (mark, now) = (mark.get(..*len), word.get_mut(..*len));
                    let (Some(mark), Some(now)) = (mark, now) else { return Err(StoreError) };
                    flash.read(*at, now).await.map_err(|_| StoreError)?;
                    if now == mark {
                        continue;
                    }
                    if now.iter().any(|&byte| byte != 0xff) {
                        return Err(StoreError);
                    }
                    flash.write(*at, mark).await
                }
            }
            .map_err(|_| StoreError)?;
        }
        Ok(known.standing(slots))
    }
}
