//! Saved parameters at the start: looked for, put into effect, and room made for more.

use crate::model::{FINGERS, JOINTS};
use blindgrasp_shared::identity::Restored;
use blindgrasp_shared::store::Store;
use blindgrasp_shared::tick::Params;
use embedded_storage::nor_flash::NorFlash;

/// The store of saved parameters in a flash, after those of a hand were put into effect; nothing if the flash can't be read.
///
/// It erases a sector if there is little room, which stops the processor for as long as that takes. Hence **with the
/// outputs off, and before the watchdog and the line start**.
#[cold]
pub fn restore<F: NorFlash>(
    flash: F,
    hand_hash: u32,
    params: &mut Params<JOINTS, FINGERS>,
) -> Option<(Store<F>, Restored)> {
    let Ok(mut store) = Store::open(flash) else {
        defmt::error!("saved parameters: their flash can't be read");
        return None;
    };
    let prepared = store.prepare();
    let restored = store.restore(hand_hash, params, |entry| {
        defmt::warn!(
            "saved parameters: {=u32:08x}[{=u8}] = {=f32} is ignored",
            entry.key,
            entry.index,
            entry.value
        );
    });
    // Without room, nothing can be saved before the next start.
    defmt::info!(
        "saved parameters: {=u16}, {=u16} of them ignored; room for {=u32} saves; a sector was erased: {=bool}, can't be: {=bool}",
        restored.saved,
        restored.ignored,
        store.free_slots(),
        prepared == Ok(true),
        prepared.is_err()
    );
    Some((store, restored))
}
