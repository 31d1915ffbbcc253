# mapspeak from this checkout, as a user who may write nothing but its memory.
FROM python:3.12-slim
COPY . /source
RUN cd /source \
    && pip install --no-cache-dir --requirement constraints/build.txt \
        --requirement constraints/runtime.txt \
    && pip install --no-cache-dir --no-deps --no-build-isolation . \
    && cd / && rm -r /source \
    && useradd --create-home mapspeak \
    && install --directory --owner mapspeak /memory
USER mapspeak
ENTRYPOINT ["mapspeak"]
