use super::*;

/// Numbers of the RTDE guide, one by one: a shifted list would still agree with itself.
#[test]
fn numbers_and_words_are_those_of_the_guides() {
    assert_eq!(RobotMode::from_number(-1), Some(RobotMode::NoController));
    assert_eq!(RobotMode::from_number(3), RobotMode::from_word("POWER_OFF"));
    assert_eq!(RobotMode::from_number(5), RobotMode::from_word("IDLE"));
    assert_eq!(RobotMode::from_number(7), RobotMode::from_word("RUNNING"));
    assert_eq!(SafetyStatus::from_number(1), SafetyStatus::from_word("NORMAL"));
    assert_eq!(SafetyStatus::from_number(3), SafetyStatus::from_word("PROTECTIVE_STOP"));
    assert_eq!(SafetyStatus::from_number(5), SafetyStatus::from_word("SAFEGUARD_STOP"));
    assert_eq!(SafetyStatus::from_number(7), SafetyStatus::from_word("ROBOT_EMERGENCY_STOP"));
    assert_eq!(SafetyStatus::from_number(9), SafetyStatus::from_word("FAULT"));
}

#[test]
fn every_number_has_one_word_and_the_way_back() {
    for number in -1..=8 {
        let mode = RobotMode::from_number(number).unwrap();
        assert_eq!((mode.number(), RobotMode::from_word(mode.name())), (number, Some(mode)));
    }
    for number in 1..=13 {
        let status = SafetyStatus::from_number(number).unwrap();
        assert_eq!((status.number(), SafetyStatus::from_word(status.name())), (number, Some(status)));
        assert_eq!(status.allows_motion(), number <= 2, "{}", status.name());
    }
    assert_eq!((RobotMode::from_number(-2), RobotMode::from_number(9)), (None, None));
    assert_eq!((SafetyStatus::from_number(0), SafetyStatus::from_number(14)), (None, None));
    assert_eq!((RobotMode::from_word("running"), SafetyStatus::from_word("")), (None, None));
}
