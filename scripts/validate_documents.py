"""Reads a run of Bluesky documents as the package event-model has them (PyPI: event-model), and validates each.

Usage: python3 validate_documents.py FILE.jsonl      (prints what is in a file of `palpate export SESSION --bluesky FILE.jsonl`)
"""
import json

# What a value of each dtype of a data key is in JSON; NaN is a float.
KINDS = {"number": (int, float), "integer": int, "string": str}


def documents(file):
    """(name, document) of every line, as the package suitcase-jsonl writes them."""
    with open(file) as lines:
        for line in lines:
            name, document = json.loads(line)
            yield name, document


def read(file):
    """The run of a file: its start and stop, and of each stream the descriptor and the events."""
    import event_model

    class Run(event_model.SingleRunDocumentRouter):
        """Collects one run; its base class refuses a document of another run, and unpacks the pages."""

        def __init__(self):
            super().__init__()
            self.streams = {}
            self.stopped = None

        def event(self, event):
            descriptor = self.get_descriptor(event)
            keys = descriptor["data_keys"]
            if not keys.keys() == event["data"].keys() == event["timestamps"].keys():
                raise ValueError(f"event {event['uid']} has other keys than its descriptor")
            for name, value in event["data"].items():
                if not isinstance(value, KINDS[keys[name]["dtype"]]):
                    raise ValueError(f"{name} of event {event['uid']} is {value!r}, no {keys[name]['dtype']}")
            self.streams.setdefault(self.get_stream_name(event), (descriptor, []))[1].append(event)

        def stop(self, document):
            self.stopped = document

    run, seen, ids = Run(), 0, set()
    router = event_model.RunRouter([lambda name, document: ([run], [])])
    for name, document in documents(file):
        event_model.schema_validators[event_model.DocumentNames[name]].validate(document)
        own = document["uid"] if name == "event_page" else [document["uid"]]
        ids.update(own)
        seen += len(own)
        router(name, document)
    if len(ids) != seen:
        raise ValueError(f"{file}: {seen} documents and events have {len(ids)} identifiers")
    counts = {name: len(events) for name, (_, events) in run.streams.items()}
    stated = {name: count for name, count in run.stopped["num_events"].items() if count}
    if counts != stated:
        raise ValueError(f"{file}: the streams have {counts} events, but the end states {stated}")
    for name, (_, events) in run.streams.items():
        if [event["seq_num"] for event in events] != list(range(1, len(events) + 1)):
            raise ValueError(f"{file}: the events of {name} are not numbered from 1")
    return run.get_start(), run.streams, run.stopped


if __name__ == "__main__":
    import sys

    start, streams, stop = read(sys.argv[1])
    print(f"run {start['uid']} of {start['plan_name']}: {stop['exit_status']} ({stop['reason']})")
    for name, (descriptor, events) in streams.items():
        print(f"{name}: {len(events)} events of {', '.join(descriptor['data_keys'])}")
