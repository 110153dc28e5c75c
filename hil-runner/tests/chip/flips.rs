//! A changed bit of the law's machine code is found, and an image as it is passes.

use std::collections::BTreeSet;

use hil_runner::chip::certify::flips::{Campaign, Flip, Kind, Outcome};
use hil_runner::chip::certify::{HostTrace, stored};
use hil_runner::chip::image::Finder;
use hil_runner::chip::spec::{Target, Transport};

use crate::same_codes::case;
use crate::targets::targets;

#[test]
fn a_flip_in_a_product_of_the_law_is_found() {
    if !targets("flips of an image", Transport::Fifo).contains(&Target::M4) {
        return;
    }
    let finder = Finder::from_environment();
    let image = finder.image(Target::M4, "fifo", &mut |line| eprintln!("{line}"));
    let vectors = stored();
    let case = case("paper-2", &[]);
    let hosts = [HostTrace::record(&case, &mut |_| Ok(())).unwrap()];
    // The contrast: the image as it is passes, or there would be no campaign.
    let campaign = Campaign::new(Target::M4, &image.unwrap(), &vectors, &hosts).unwrap();
    let executed = campaign.executed();
    assert!(executed.len() > 1_000, "{}", executed.len());

    // Only the law has signed products of 64 bits; bit 16 is one of a factor's register.
    // Those of a first sample with its errors 0 make no difference.
    let products = executed
        .iter()
        .filter(|(_, found)| found.text.starts_with("smull"));
    let ends: Vec<_> = products
        .map(|(&address, _)| campaign.run(Flip { address, bit: 16 }).unwrap())
        .collect();
    let is_number = |end: &&Outcome| {
        matches!(
            end,
            Outcome::Found {
                kind: Kind::Number,
                ..
            }
        )
    };
    let found = ends.iter().filter(is_number).count();
    assert!(found >= 4 && 3 * found >= 2 * ends.len(), "{ends:#?}");

    // The draw is the seed's, and no instruction comes twice.
    let flips = campaign.draw(200, 1).unwrap();
    assert_eq!(flips, campaign.draw(200, 1).unwrap());
    assert_ne!(flips, campaign.draw(200, 2).unwrap());
    let addresses: BTreeSet<u32> = flips.iter().map(|flip| flip.address).collect();
    assert_eq!(addresses.len(), 200);
    let ends = flips
        .iter()
        .take(6)
        .map(|flip| campaign.run(*flip).unwrap());
    let found = ends
        .filter(|end| matches!(end, Outcome::Found { .. }))
        .count();
    assert!(found >= 2, "{found} of 6");

    let too_many = campaign
        .draw(executed.len() + 1, 1)
        .unwrap_err()
        .to_string();
    assert!(too_many.contains("flips are too many"), "{too_many}");
    let nowhere = campaign
        .run(Flip {
            address: 0x7000_0000,
            bit: 0,
        })
        .unwrap_err();
    let words = "no byte at 0x70000000";
    assert!(nowhere.to_string().contains(words), "{nowhere}");
}
