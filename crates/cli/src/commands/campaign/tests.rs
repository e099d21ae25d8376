use super::*;

/// What is printed, filled in and saved is a table of measured pulls.
#[test]
fn a_table_that_was_filled_in_is_read_as_measured_pulls() {
    let options = CampaignOptions { parts: vec!["gear".into()], pulls: 24, ..CampaignOptions::default() };
    let campaign = plan_campaign(&options).unwrap();
    let text = String::from_utf8(table_csv(&campaign)).unwrap();
    assert!(text.starts_with("pull_id,part,gel_id,session,grip_force_n,"), "{text}");
    assert_eq!(text.lines().count(), 25);
    // Somebody writes temperature and label into each row.
    let filled = text.replace(",,,,", ",,21.5,6.25,");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("pulls.csv"), filled).unwrap();
    let read = gripgen_measured::read_pull_folder(folder.path()).unwrap();
    assert_eq!(read.pulls.len(), 24);
    assert!(read.pulls.iter().all(|p| p.max_pull_force_n == 6.25 && p.covariates.temperature_c == 21.5));
    let blocks = blocks(&campaign);
    assert_eq!(blocks.iter().map(|b| b.pulls).sum::<u64>(), 24);
    let minutes: f64 = blocks.iter().map(|b| b.minutes).sum();
    assert!((minutes - campaign.estimated_minutes()).abs() < 1e-9);
}
