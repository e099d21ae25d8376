# gripgen in a container: `docker build -t gripgen .`, then `docker run --rm -v "$PWD/runs:/runs" gripgen sweep ...`.
# First stage: the wheel. Second stage: Python with it.
FROM rust:1.95-bookworm AS build
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3-venv patchelf \
    && rm -rf /var/lib/apt/lists/*
RUN python3 -m venv /opt/maturin && /opt/maturin/bin/pip install --no-cache-dir maturin==1.16.0
WORKDIR /src
COPY . .
RUN /opt/maturin/bin/maturin build --release --locked --out /dist

FROM python:3.13-slim-bookworm
COPY --from=build /dist /dist
RUN pip install --no-cache-dir /dist/*.whl && rm -r /dist && useradd --create-home gripgen
USER gripgen
WORKDIR /home/gripgen
ENTRYPOINT ["gripgen"]
CMD ["--help"]
