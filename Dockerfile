# safenav without a compiler on the machine:
#   docker build -t safenav .
#   docker run --rm -v "$PWD:/work" safenav run scenario.yaml --html run.html
FROM python:3.13-slim AS build
RUN apt-get update && apt-get install --yes --no-install-recommends g++ && rm -rf /var/lib/apt/lists/*
COPY . /source
RUN pip install --no-cache-dir wheel && python /source/packaging/wheel.py /wheels

FROM python:3.13-slim
COPY --from=build /wheels /wheels
RUN wheel=$(echo /wheels/*.whl) && pip install --no-cache-dir "$wheel[pictures,mcap]" && rm -r /wheels
WORKDIR /work
ENTRYPOINT ["safenav"]
