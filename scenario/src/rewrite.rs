//! Changes values in a scenario file and keeps comments, order and blanks.

use toml_edit::{DocumentMut, Item, TableLike, Value};

use super::error::ScenarioError;

/// Returns the text with these values, each written as after `--set KEY=`. A key without a value is removed. A new key
/// is added at the end of its table.
///
/// # Errors
/// Returns an error if the text is not TOML, if a key is in a list, or if the parent of a key is not a table.
pub fn rewritten<'a>(
    text: &str,
    changes: impl IntoIterator<Item = (&'a str, Option<&'a str>)>,
) -> Result<String, ScenarioError> {
    let document = text.parse::<DocumentMut>();
    let mut document = document.map_err(|error| ScenarioError::of_file("not TOML", error.message()))?;
    for (path, value) in changes {
        change(&mut document, path, value)?;
    }
    Ok(document.to_string())
}

fn change(document: &mut DocumentMut, path: &str, value: Option<&str>) -> Result<(), ScenarioError> {
    if path.contains('[') {
        return Err(ScenarioError::of_file(path, "an entry of a list cannot be changed here: edit the file"));
    }
    let mut keys: Vec<&str> = path.split('.').map(str::trim).collect();
    let Some(last) = keys.pop() else { return Ok(()) };
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for key in keys {
        if value.is_none() && !table.contains_key(key) {
            return Ok(());
        }
        let inner = table.entry(key).or_insert_with(toml_edit::table);
        let inner = inner.as_table_like_mut();
        table = inner.ok_or_else(|| ScenarioError::of_file(path, format!("{key} is not a table of the file")))?;
    }
    let Some(value) = value.map(str::trim) else {
        table.remove(last);
        return Ok(());
    };
    let mut value = value.parse::<Value>().unwrap_or_else(|_| value.into());
    if let Some(there) = table.get_mut(last).and_then(Item::as_value_mut) {
        // The comment after the value stays.
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
        for (path, why) in [("load[0].amplitude", "an entry of a list"), ("title.a", "title is not a table")] {
            assert!(rewritten(text, [(path, Some("1"))]).expect_err("an error").to_string().contains(why), "{path}");
        }
        assert!(rewritten("a = ", []).is_err());
    }
}
