use super::*;

/// Byte sequences of the Universal Robots Client Library's own tests, as hexadecimal.
fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
}

fn names(list: &str) -> Vec<String> {
    list.split(',').map(String::from).collect()
}

fn plan(outputs: &str, inputs: &[&str]) -> SessionPlan {
    SessionPlan {
        outputs: names(outputs),
        frequency_hz: 500.0,
        inputs: inputs.iter().map(|i| names(i)).collect(),
    }
}

fn frame(kind: Kind, payload: &[u8]) -> Vec<u8> {
    encode_frame(kind, payload).unwrap()
}

/// A session that runs, with the recipes of the published sequences.
fn running(inputs: &[&str], answers: &[&str]) -> Link {
    let mut link = Link::new(plan("timestamp,actual_q", inputs)).unwrap();
    link.receive(&bytes("00045601")).unwrap();
    link.receive(&bytes("00137600000005000000080000000000000000")).unwrap();
    link.receive(&bytes("00134f01444f55424c452c564543544f523644")).unwrap();
    for answer in answers {
        link.receive(&bytes(answer)).unwrap();
    }
    link.take_outgoing();
    assert_eq!(link.receive(&bytes("00045301")).unwrap(), [Event::Started]);
    link
}

#[test]
fn a_session_sends_the_published_bytes() {
    let mut link =
        Link::new(plan("actual_q,actual_qd", &["speed_slider_mask,speed_slider_fraction"])).unwrap();
    assert_eq!(link.take_outgoing(), bytes("0005560002"));
    assert!(link.receive(&bytes("00045601")).unwrap().is_empty());
    assert_eq!(link.take_outgoing(), bytes("000376"));
    let version = link.receive(&bytes("00137600000005000000080000000000000000")).unwrap();
    assert_eq!(version, [Event::ControllerVersion([5, 8, 0, 0])]);
    let outputs = "001d4f407f40000000000061637475616c5f712c61637475616c5f7164";
    assert_eq!(link.take_outgoing(), bytes(outputs));
    assert!(link.receive(&frame(Kind::SetUpOutputs, b"\x01VECTOR6D,VECTOR6D")).unwrap().is_empty());
    let inputs = "002a4973706565645f736c696465725f6d61736b2c73706565645f736c696465725f6672616374696f6e";
    assert_eq!(link.take_outgoing(), bytes(inputs));
    link.receive(&bytes("0011490155494e5433322c444f55424c45")).unwrap();
    assert_eq!(link.take_outgoing(), frame(Kind::Start, &[]));
    assert!(!link.is_running());
    assert_eq!(link.receive(&bytes("00045301")).unwrap(), [Event::Started]);
    link.write_input(0, &[Value::Uint32(1), Value::Double(0.5)]).unwrap();
    assert_eq!(link.take_outgoing(), bytes("001055 01 00000001 3fe0000000000000".replace(' ', "").as_str()));
    let mut before = Link::new(plan("actual_q", &[])).unwrap();
    assert_eq!(before.write_input(0, &[]), Err(WriteInputError::NotStarted));
    assert_eq!(before.receive(&bytes("00045600")), Err(SessionError::Protocol));
}

#[test]
fn the_published_data_frames_have_the_published_values() {
    let recipe = Recipe::from_answer(&names("a,b"), b"\x01DOUBLE,DOUBLE").unwrap();
    let data = bytes("0014550140d0070d2f1a9fbe3ff0000000000000");
    let values = recipe.read(&data[3..]).unwrap();
    let [Value::Double(a), Value::Double(b)] = values[..] else { panic!("{values:?}") };
    assert!((a - 16_412.206).abs() < 1e-3 && b == 1.0);
    assert_eq!(frame(Kind::Data, &recipe.write(&values).unwrap()), data);
    let mut link =
        running(&["input_double_register_24,input_int_register_24"], &["00104901444f55424c452c494e543332"]);
    link.write_input(0, &[Value::Double(12.5), Value::Int32(7)]).unwrap();
    assert_eq!(link.take_outgoing(), bytes("00105501402900000000000000000007"));
    let e = link.write_input(0, &[Value::Double(1.0), Value::Double(2.0)]).unwrap_err();
    assert_eq!(e.to_string(), "field 1 is a Double, its recipe says Int32");
    assert!(matches!(link.write_input(1, &[]), Err(WriteInputError::NoRecipe { recipe: 1, recipes: 1 })));
}

#[test]
fn every_type_comes_back_as_it_was_sent() {
    let values = [
        Value::Bool(true),
        Value::Uint8(200),
        Value::Uint32(4_000_000_000),
        Value::Uint64(1 << 40),
        Value::Int32(-7),
        Value::Double(-0.5),
        Value::Vector3d([1.0, 2.0, 3.0]),
        Value::Vector6d([1.0, -2.0, 3.0, -4.0, 5.0, -6.0]),
        Value::Vector6int32([1, -2, 3, -4, 5, -6]),
        Value::Vector6uint32([1, 2, 3, 4, 5, 6]),
    ];
    let types: Vec<&str> = values.iter().map(|v| v.field_type().name()).collect();
    let answer = [&[9][..], types.join(",").as_bytes()].concat();
    let recipe = Recipe::from_answer(&vec!["x".to_string(); 10], &answer).unwrap();
    let payload = recipe.write(&values).unwrap();
    assert_eq!(payload.len(), 1 + recipe.size());
    assert_eq!(recipe.read(&payload).unwrap(), values);
    assert!(recipe.read(&payload[..payload.len() - 1]).is_none(), "too short");
    assert!(recipe.read(&[&[8], &payload[1..]].concat()).is_none(), "another recipe");
}

/// The stream of a session cut anywhere gives the same events.
#[test]
fn pieces_of_any_size_give_the_same_events() {
    let mut stream = bytes("00045601");
    stream.extend(bytes("00137600000005000000080000000000000000"));
    stream.extend(frame(Kind::Text, b"\x05hello\x02UR\x03"));
    stream.extend(bytes("00134f01444f55424c452c564543544f523644"));
    stream.extend(bytes("00045301"));
    for i in 0..20 {
        let mut payload = vec![1];
        payload.extend((f64::from(i) * 0.002).to_be_bytes());
        payload.extend([0; 48]);
        stream.extend(frame(Kind::Data, &payload));
    }
    let events = |size: usize| {
        let mut link = Link::new(plan("timestamp,actual_q", &[])).unwrap();
        stream.chunks(size).flat_map(|piece| link.receive(piece).unwrap()).collect::<Vec<_>>()
    };
    let whole = events(stream.len());
    assert_eq!(whole.len(), 23);
    assert!(whole.contains(&Event::Text { text: "hello".into(), source: "UR".into(), level: 3 }));
    for size in [1, 2, 3, 7, 58, 61, 200] {
        assert_eq!(events(size), whole, "pieces of {size}");
    }
}

#[test]
fn what_a_controller_refuses_is_named() {
    let refused = |answer: &[u8]| Recipe::from_answer(&names("a,b"), answer).unwrap_err().to_string();
    assert_eq!(refused(b"\0NOT_FOUND,VECTOR6D"), "the controller does not know a");
    assert_eq!(refused(b"\0IN_USE,IN_USE"), "another client, or a fieldbus, has a, b");
    assert_eq!(refused(b"\x01DOUBLE"), "the controller answers with 1 types to 2 names");
    assert_eq!(refused(b"\x01DOUBLE,TENSOR"), "`b` has the unknown type `TENSOR`");
    let mut link = Link::new(plan("timestamp,actual_q", &[])).unwrap();
    for answer in
        ["00045601", "00137600000005000000080000000000000000", "00134f01444f55424c452c564543544f523644"]
    {
        link.receive(&bytes(answer)).unwrap();
    }
    assert_eq!(link.receive(&bytes("00045300")), Err(SessionError::Refused));
    assert_eq!(Link::new(plan(&"x".repeat(3000), &[])).unwrap_err(), SessionError::Names { bytes: 3000 });
}

#[test]
fn a_clock_that_goes_back_is_a_controller_that_restarted() {
    let mut link = running(&[], &[]);
    let at = |time_s: f64| {
        let mut payload = vec![1];
        payload.extend(time_s.to_be_bytes());
        payload.extend([0; 48]);
        frame(Kind::Data, &payload)
    };
    assert_eq!(link.receive(&[at(40.0), at(40.002)].concat()).unwrap().len(), 2);
    let e = link.receive(&at(0.002)).unwrap_err();
    assert_eq!(e, SessionError::Restarted { before_s: 40.002, now_s: 0.002 });
}

#[test]
fn malformed_frames_end_the_session_with_both_numbers() {
    let error = |wire: &[u8]| Link::new(plan("a", &[])).unwrap().receive(wire).unwrap_err().to_string();
    assert_eq!(error(&[0, 2, b'V']), "a frame says that it is 2 bytes long, its header alone is 3");
    assert_eq!(error(&[0, 5, 2, 0, 0]), "a frame of 5 bytes is of the unknown kind 2");
    // A version that is accepted with two bytes.
    assert_eq!(
        error(&bytes("0005560101")),
        "an answer of kind ProtocolVersion is 2 bytes long, 1 were expected"
    );
}
