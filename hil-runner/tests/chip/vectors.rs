//! The golden vectors at the end of a line.

use hil_runner::chip::certify::{VectorFile, replay, stored};
use hil_runner::chip::client::Client;

use crate::loopback::Loopback;

/// Every row of every file.
pub(crate) fn replay_all(client: &mut Client) {
    let files = stored();
    assert!(files.len() >= 23, "{}", files.len());
    let mut rows = 0;
    for file in &files {
        let replayed = replay(client, file, &mut || Ok(())).unwrap();
        assert_eq!(replayed.difference, None, "{}", file.name);
        let on_host = firmware_link::vectors::replay(&file.text).unwrap();
        assert_eq!(replayed.compared, on_host as u64, "{}", file.name);
        rows += replayed.compared;
    }
    println!("{} files, {rows} rows", files.len());
    assert!(rows > 3_900, "{rows}");
}

#[test]
fn a_chip_in_memory_gives_every_row() {
    replay_all(&mut Client::greet(Box::new(Loopback::new())).unwrap());
}

fn file(name: &str) -> VectorFile {
    let mut files = stored().into_iter();
    files.find(|file| file.name == name).unwrap()
}

/// The contrast: each number of one output, one off, is found in its line.
#[test]
fn another_number_in_a_file_is_found() {
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let VectorFile { name, text } = file("fault-encoder-loss.txt");
    let mut lines = text.lines().enumerate();
    let (place, line) = lines
        .find(|(_, line)| line.contains("encoder-loss "))
        .unwrap();
    let (inputs, outputs) = line.split_once(" | ").unwrap();
    let columns: Vec<&str> = outputs.split(' ').collect();
    let mut numbers = 0;
    for (column, value) in columns.iter().enumerate() {
        let Ok(number) = value.parse::<i64>() else {
            continue;
        };
        let mut other: Vec<String> = columns.iter().map(ToString::to_string).collect();
        other[column] = (number ^ 1).to_string();
        let text = text.replace(line, &format!("{inputs} | {}", other.join(" ")));
        let name = name.clone();
        let replayed = replay(&mut client, &VectorFile { name, text }, &mut || Ok(()));
        let found = replayed.unwrap().difference.unwrap();
        assert_eq!(
            (found.at, found.numbers.len()),
            (place as u64 + 1, 1),
            "{found}"
        );
        numbers += 1;
    }
    // Code, error, power, range, and 7 of the fault.
    assert_eq!(numbers, 11);
}

/// A change of gains, and of more than gains, in mid-move is sent as what it is.
#[test]
fn settings_between_rows_are_sent() {
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let VectorFile { name, text } = file("gains-change.txt");
    for setting in ["kp = 1717986918 30\n", "quantiser = error-feedback\n"] {
        assert_eq!(text.matches(setting).count(), 1);
        let without = VectorFile {
            name: name.clone(),
            text: text.replace(setting, ""),
        };
        let replayed = replay(&mut client, &without, &mut || Ok(())).unwrap();
        let found = replayed.difference.unwrap().to_string();
        assert!(found.contains("of gains-change.txt: code "), "{found}");
        assert!(found.ends_with(" in the file"), "{found}");
    }
}

#[test]
fn what_cannot_be_replayed_is_said() {
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let mut sentence = |text: &str, change: &str| {
        let file = VectorFile {
            name: "a.txt".to_owned(),
            text: text.replace("ES 0", change),
        };
        let error = replay(&mut client, &file, &mut || Ok(())).unwrap_err();
        error.to_string()
    };
    let text = "dac_bits = 12\nkp = 1073741824 29\nES 0 0 - 0 0 next 0 0 0 | 0 0 moving 1 0 -\n";
    let found = sentence(text, "X 0");
    assert_eq!(found, "a.txt, line 3: it is neither a setting nor a row");
    // The line has one order of requests.
    let found = sentence(text, "SE 0");
    assert_eq!(found, "a.txt, line 3: it is neither a setting nor a row");
    let interrupted = replay(&mut client, &file("paper.txt"), &mut || {
        Err(std::io::Error::other("interrupted"))
    });
    assert_eq!(interrupted.unwrap_err().to_string(), "interrupted");
}
