# cosim for a vehicle's computer or a desktop, aarch64 or x86-64: docker build --tag cosim .
FROM python:3.12-slim AS build
COPY . /src
RUN python3 -m venv /opt/cosim
RUN /opt/cosim/bin/pip install --no-cache-dir /src/fuzzy_arbiter "/src[logs,mcap]"
RUN mkdir -m 1777 /opt/runs

FROM python:3.12-slim
COPY --from=build /opt /opt
ENV PATH=/opt/cosim/bin:/usr/bin:/bin HOME=/tmp
USER 1000
WORKDIR /opt/runs
ENTRYPOINT ["cosim"]
CMD ["--help"]
