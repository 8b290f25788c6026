use super::*;
use crate::report::plot::BLACK;

fn panel(title: &str, series: Vec<Series>) -> Panel {
    Panel { title: title.into(), x_label: "t (s)".into(), y_label: "y (rad)".into(), series, ..Panel::default() }
}

fn account(name: &str, value: &str, more: Option<&str>) -> Account {
    let mut table = Table::new(["metric", "value", "unit"]);
    table.row(["peak", value, "rad"]);
    if let Some(more) = more {
        table.row([more, "7", "s"]);
    }
    let curve = Series::solid("y", 0, (0..100).map(|k| (f64::from(k) * 1e-3, (f64::from(k) * 0.1).sin())));
    Account {
        name: name.into(),
        sections: vec![Section {
            heading: "Run".into(),
            says: vec!["it went well".into()],
            tables: vec![table],
            figures: vec![Figure { title: "Run".into(), panels: vec![panel("Output", vec![curve])], columns: 1 }],
            drawings: vec!["<svg></svg>".into()],
            files: vec![("a.toml".into(), "a = 1\nb = \"<2>\"\n".into())],
        }],
    }
}

fn html(accounts: &[Account]) -> String {
    Page { title: "a report", accounts }.html().expect("a page")
}

/// Returns the text between the last occurrences of these words.
fn within<'a>(text: &'a str, before: &str, after: &str) -> &'a str {
    let (_, rest) = text.rsplit_once(before).expect(before);
    rest.split_once(after).expect(after).0
}

#[test]
fn it_asks_nobody_for_anything() {
    let page = html(&[account("one", "1", None)]);
    for asks in
        ["src=", "href=\"http", "href='", "@import", "url(h", "fetch(", "XMLHttp", "import(", "<base", "<iframe"]
    {
        assert!(!page.contains(asks), "{asks}");
    }
}

#[test]
fn what_is_read_back_makes_the_same_page_again() {
    let accounts = [account("one", "1", None), account("two", "2", Some("settling"))];
    let page = html(&accounts);
    let again = super::accounts(&page).expect("its accounts");
    let json = |accounts: &[Account]| serde_json::to_string(accounts).expect("numbers");
    assert_eq!(json(&again), json(&accounts));
    assert_eq!(within(&html(&again), "id=\"charts\">", "</script>"), within(&page, "id=\"charts\">", "</script>"));
    assert_eq!(again[0].sections[0].files, accounts[0].sections[0].files);
}

/// A drawing comes from a file that somebody else may have written.
#[test]
fn a_drawing_with_more_than_lines_and_text_is_left_out() {
    let curve = Series::solid("y > \"z\" & <w>", 0, [(0.0, 1.0), (1.0, 2.0)]);
    let own = Figure { title: "A > b".into(), panels: vec![panel("Output", vec![curve])], columns: 1 }.svg();
    assert!(is_still(&own) && is_still("<svg></svg>"), "{own}");
    for (what, with) in [
        ("<svg ", "<svg onload=\"a()\" "),
        ("<svg ", "<svg ONLOAD=\"a()\" "),
        ("<svg ", "<svg onload =\"a()\" "),
        ("<svg ", "<svg/onload=a() "),
        ("<svg ", "<svg id='x'onload=a() "),
        ("<svg ", "<svg id=\">\" onload=\"a()\" "),
        ("</svg>", "<script>a()</script></svg>"),
        ("</svg>", "<foreignObject></foreignObject></svg>"),
        ("</svg>", "<a href=\"javascript:a()\"></a></svg>"),
        ("</svg>", "</svg><!-- --><img src=\"x\">"),
    ] {
        let spoilt = own.replacen(what, with, 1);
        assert!(spoilt != own && !is_still(&spoilt), "{with}");
    }
    let mut one = account("one", "1", None);
    one.sections[0].drawings = vec![own.replacen("<svg ", "<svg onload=\"a()\" ", 1)];
    let page = html(&[one]);
    assert!(page.contains("A drawing is left out") && !within(&page, "<section", "<script").contains("onload"));
}

#[test]
fn a_file_that_is_no_report_has_no_accounts() {
    let page = html(&[account("one", "1", None)]);
    let cut = page.find(DATA_BEGINS).expect("its accounts") + DATA_BEGINS.len() + 100;
    for other in ["", "<html></html>", &page.replace("\"name\"", "\"nome\""), &page[..cut]] {
        assert_eq!(accounts(other), None);
    }
}

#[test]
fn points_are_packed_with_their_gaps_and_any_places() {
    let even = (0..5000).map(|k| (f64::from(k) * 1e-4, f64::from(k).sqrt()));
    let uneven = [(0.0, 1.0), (0.3, f64::NAN), (0.300_000_000_000_000_04, -0.0), (7.0, f64::INFINITY)];
    for points in [even.collect::<Vec<_>>(), uneven.to_vec(), vec![], vec![(3.0, 4.0)]] {
        let series = Series::solid("y", 0, points.clone());
        let text = serde_json::to_string(&series).expect("numbers");
        let again: Series = serde_json::from_str(&text).expect("a series");
        let bits = |points: &[(f64, f64)]| -> Vec<(u64, u32)> {
            points.iter().map(|(x, y)| (x.to_bits(), (*y as f32).to_bits())).collect()
        };
        assert_eq!(bits(&again.points), bits(&points));
    }
    for damaged in ["{\"y\":\"AAAA\"}", "{\"step\":1.0,\"y\":\"?\"}", "{\"x\":\"\",\"y\":\"AAAAAA==\"}"] {
        let text = format!(
            "{{\"label\":\"y\",\"points\":{damaged},\"style\":\"Solid\",\"color\":0,\"is_held\":false,\
             \"has_dots\":false}}"
        );
        let read = serde_json::from_str::<Series>(&text);
        // Fewer bytes than a number give no point.
        assert!(read.as_ref().map_or(true, |series| series.points.is_empty()), "{damaged}: {read:?}");
    }
}

#[test]
fn values_stand_side_by_side_with_their_quotient() {
    let page = html(&[account("one", "2", None), account("two", "5", Some("settling"))]);
    assert!(page.contains("<tr><th>metric</th><th>one</th><th>two</th><th>two / one</th><th>unit</th></tr>"));
    assert!(page.contains("<tr><td>peak</td><td>2</td><td>5</td><td>2.50</td><td>rad</td></tr>"));
    assert!(page.contains("<tr><td>settling</td><td>-</td><td>7</td><td></td><td>s</td></tr>"));
}

#[test]
fn the_same_panel_has_the_curves_of_both_and_another_stands_alone() {
    let mut two = account("two", "2", None);
    two.sections[0].figures[0].panels.push(panel("Load", vec![Series::solid("", BLACK, [(0.0, 1.0)])]));
    let page = html(&[account("one", "1", None), two]);
    let charts: serde_json::Value = serde_json::from_str(within(&page, "id=\"charts\">", "</script>")).expect("charts");
    let labels = |k: usize| -> Vec<&str> {
        charts[k]["curves"].as_array().expect("curves").iter().filter_map(|curve| curve["label"].as_str()).collect()
    };
    assert_eq!((labels(0), labels(1)), (vec!["one, y", "two, y"], vec!["two"]));
    assert_eq!(charts[1]["curves"][0]["at"], serde_json::json!([1, 0, 0, 1, 0]));
    assert_ne!(charts[0]["curves"][0]["color"], charts[0]["curves"][1]["color"]);
}

#[test]
fn what_is_no_curve_over_time_is_drawn_and_does_not_zoom() {
    let mut one = account("one", "1", None);
    one.sections[0].figures[0].panels[0].series[0].points.reverse();
    let page = html(&[one]);
    assert!(page.contains("<figure><svg") && !page.contains("data-chart"));
}

#[test]
fn words_that_look_like_markup_stay_words() {
    let evil = "</script><script>alert('1')</script><b>&amp;";
    let mut accounts = [account(evil, evil, Some(evil)), account("two", "2", None)];
    let section = &mut accounts[0].sections[0];
    section.heading = evil.into();
    section.says.push(evil.into());
    section.files.push((evil.into(), evil.into()));
    let figure = &mut section.figures[0];
    figure.title = evil.into();
    figure.panels[0].title = evil.into();
    figure.panels[0].series[0].label = evil.into();
    let page = html(&accounts);
    // Two scripts with numbers and two that draw.
    assert_eq!(page.matches("<script").count(), 4);
    assert_eq!(page.matches("</script>").count(), 4);
    assert_eq!(super::accounts(&page).expect("accounts")[0].name, evil);
}
