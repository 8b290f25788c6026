//! A scenario as a file with other values at some keys: all else stays as it is, comments, order and blanks.

use toml_edit::{DocumentMut, Item, TableLike, Value};

/// The text with these values, each as behind `--set KEY=`; a key without a value goes, with all that is in it. A key
/// that is not there yet comes at the end of its table.
///
/// # Errors
/// What is no TOML, or no key of a table: that of an entry of a list, or one whose table is something else.
pub fn rewritten<'a>(
    text: &str,
    changes: impl IntoIterator<Item = (&'a str, Option<&'a str>)>,
) -> Result<String, String> {
    let mut document = text.parse::<DocumentMut>().map_err(|error| error.to_string())?;
    for (path, value) in changes {
        change(&mut document, path, value).map_err(|why| format!("{path}: {why}"))?;
    }
    Ok(document.to_string())
}

fn change(document: &mut DocumentMut, path: &str, value: Option<&str>) -> Result<(), String> {
    if path.contains('[') {
        return Err("an entry of a list is not written into a file: change it there".into());
    }
    let mut keys: Vec<&str> = path.split('.').map(str::trim).collect();
    let Some(last) = keys.pop() else { return Ok(()) };
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for key in keys {
        if value.is_none() && !table.contains_key(key) {
            return Ok(());
        }
        let inner = table.entry(key).or_insert_with(toml_edit::table);
        table = inner.as_table_like_mut().ok_or_else(|| format!("{key} is no table of the file"))?;
    }
    let Some(value) = value.map(str::trim) else {
        table.remove(last);
        return Ok(());
    };
    let mut value = value.parse::<Value>().unwrap_or_else(|_| value.into());
    if let Some(there) = table.get_mut(last).and_then(Item::as_value_mut) {
        // What is beside a key stays there.
        *value.decor_mut() = there.decor().clone();
        *there = value;
    } else {
        table.insert(last, Item::Value(value));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_but_the_keys_that_change_stays_as_it_is() {
        let text = "# head\ntitle = \"x\"  # beside\n\n[joint] # what it is\na = 1.5 # N m\n\n[error]\nb = 2\n";
        let changes =
            [("joint.a", Some("2")), ("joint.gear", Some("[2, 1]")), ("error", None), ("new.mode", Some("speed"))];
        let expected = "# head\ntitle = \"x\"  # beside\n\n[joint] # what it is\na = 2 # N m\ngear = [2, 1]\n\n\
                        [new]\nmode = \"speed\"\n";
        assert_eq!(rewritten(text, changes).as_deref(), Ok(expected));
        assert_eq!(rewritten(text, [("nowhere.at.all", None)]).as_deref(), Ok(text));
        for (path, why) in [("load[0].amplitude", "an entry of a list"), ("title.a", "title is no table")] {
            assert!(rewritten(text, [(path, Some("1"))]).expect_err("a refusal").contains(why), "{path}");
        }
        assert!(rewritten("a = ", []).is_err());
    }
}
