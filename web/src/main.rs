//! Answers the requests of the page on this machine: `bits` prints the hashes, a request on stdin its answer.

use std::io::{Read as _, stdin};

fn main() {
    if std::env::args().nth(1).as_deref() == Some("bits") {
        return edo_smc_web::hashes().iter().for_each(|line| println!("{line}"));
    }
    let mut request = String::new();
    // A request that is not text is answered with an error.
    _ = stdin().read_to_string(&mut request);
    println!("{}", edo_smc_web::answer_to(&request));
}
