"""The Gymnasium environments."""

import warnings

import numpy as np
import pytest

import gripgen as gg

gym = pytest.importorskip("gymnasium")


def test_check_env_passes():
    from gymnasium.utils.env_checker import check_env

    for options in ({"part": "gear"}, {"command": "speed", "images": False}):
        env = gym.make("gripgen:gripgen/Pull-v0", **options).unwrapped
        with warnings.catch_warnings():
            # It recommends actions from -1 to 1; ours are newtons.
            warnings.filterwarnings("ignore", message=".*normalized space.*")
            check_env(env, skip_render_check=True)


def episode(env, policy, **options):
    observation, _ = env.reset(seed=5, options=options)
    total = 0.0
    while True:
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        total += reward
        if terminated or truncated:
            return observation, total, info


def test_the_staircase_policy_is_the_experiment():
    """An episode under the default policy is the pull of the simulator, bit for bit."""
    env = gym.make("gripgen/Pull-v0").unwrapped
    observation, total, info = episode(env, gg.Staircase(), part="gear", grip_force_n=40.0)
    result = env._pulls.result(0)
    _, draw = env._task.draw(np.random.Generator(np.random.PCG64(np.random.SeedSequence(5))))
    pull = gg.Sim().pull(part="gear", grip_force_n=40.0, seed=draw)
    n = len(result["time_s"])
    assert result["measured_force_n"].tolist() == pull.measured_force_n[:n].tolist()
    assert info["status"] == "slipped" and info["max_pull_force_n"] == pull.max_pull_force_n
    assert (observation["tactile"] == pull.images).all()
    assert total == pytest.approx(pull.measured_force_n.max(), abs=0.6)


def test_a_harder_grip_holds_more():
    env = gym.make("gripgen/Pull-v0", images=False, part="long_shaft").unwrapped
    held = [episode(env, gg.Staircase(), grip_force_n=f)[2]["max_pull_force_n"] for f in (20.0, 40.0, 60.0)]
    assert held == sorted(held) and held[2] > 2.5 * held[0]


def test_a_staircase_rises_from_its_start_force():
    observation = {"force": np.array([0.0, 0.0, 0.25], dtype=np.float32)}  # in its third step of 0.104 s
    wanted = {None: 1.5, 0.5: 1.5, 5.0: 6.0, 0.0: 1.0}
    assert {f: gg.Staircase(0.5, start_n=f)(observation)[0] for f in wanted} == wanted


def test_the_vector_environment_is_several_single_ones():
    options = {"images": False, "part": "gear", "vary": {"grip_force_n": 30.0}}
    vector = gym.make_vec("gripgen/Pull-v0", 3, vectorization_mode="vector_entry_point", **options)
    policy = gg.Staircase(increment_n=2.0)
    seen, _ = vector.reset(seed=11)
    rewards = []
    for _ in range(40):
        seen, reward, _, _, _ = vector.step(policy(seen))
        rewards.append(reward)
    rewards = np.array(rewards)
    # Each place under its own seed, restarted after its end, is a single environment.
    for place in range(3):
        rng = np.random.default_rng(11 + place)
        single = gym.make("gripgen/Pull-v0", **options).unwrapped
        observation, _ = single.reset(seed=0)
        single._np_random = rng
        observation, _ = single.reset()
        alone, ended = [], False
        for _ in range(40):
            if ended:
                observation, _ = single.reset()
                alone.append(0.0)
                ended = False
                continue
            observation, reward, terminated, truncated, _ = single.step(policy(observation))
            alone.append(reward)
            ended = terminated or truncated
        assert alone == pytest.approx(rewards[:, place].tolist())
    assert (rewards[0] > 0).all()


def test_threads_change_nothing():
    policy = gg.Staircase()

    def rollout(threads):
        env = gym.make_vec("gripgen/Pull-v0", 5, vectorization_mode="vector_entry_point", threads=threads, images=False)
        seen, _ = env.reset(seed=3)
        return np.array([env.step(policy(seen := env.step(policy(seen))[0]))[1] for _ in range(15)])

    assert (rollout(1) == rollout(4)).all()


def test_a_speed_command_moves_the_arm():
    env = gym.make("gripgen/Pull-v0", command="speed", images=False, part="gear").unwrapped
    env.reset(seed=1)
    for _ in range(10):
        observation, *_ = env.step(np.array([2.0], dtype=np.float32))
    # 2 mm/s for ten steps of 0.104 s.
    assert observation["force"][1] == pytest.approx(2.08, rel=0.1)
    with pytest.raises(gg.ConfigError, match="neither"):
        gym.make("gripgen/Pull-v0", command="torque")


def test_threads_may_share_pulls():
    """Two threads that step and look at the same pulls wait for each other, and not for ever."""
    import threading

    from gripgen import _core

    pulls = _core.Pulls(gg.Sim(images=False)._core, 2)
    for place in range(2):
        pulls.start(place, {"part": "gear", "grip_force_n": 60.0}, 1, place, False)
    done = []

    def work():
        for force_n in range(200):
            pulls.step(np.full(2, force_n * 0.01), 0.02, False, 2)
            pulls.result(0)
        done.append(True)

    threads = [threading.Thread(target=work, daemon=True) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(done) == 3
    with pytest.raises(gg.ConfigError, match="3 commands for 2 pulls"):
        pulls.step(np.zeros(3), 0.1)
