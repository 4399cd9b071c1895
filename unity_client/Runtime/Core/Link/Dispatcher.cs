using System;
using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>Collects messages on the receiving thread and raises their events on the main thread.</summary>
    public sealed class Dispatcher
    {
        const int LongestPlainOk = 32; // bytes; one that names parts left out is longer

        readonly Inbox inbox = new Inbox();
        readonly StringPool pool = new StringPool();
        readonly Decision decision = new Decision();
        readonly Telemetry telemetry = new Telemetry();
        readonly Skipped skipped = new Skipped();
        readonly Error error = new Error();
        readonly Ok ok = new Ok();
        readonly Vibration vibration = new Vibration();
        readonly Textures textures = new Textures();
        LinkState reportedState = LinkState.Closed;
        bool wasOwner;
        long unreadable;
        Exception failure;

        /// <summary>The service decided the material of an object, or changed its decision.</summary>
        public event Action<Decision> Decided;

        /// <summary>The state of the outputs, ten times a second.</summary>
        public event Action<Telemetry> Measured;

        /// <summary>The vibration of one hand from now on; raised only after Outbox.SetFeel requested it.</summary>
        public event Action<Vibration> Vibrated;

        /// <summary>The service asks for the texture maps with these hashes, each once a session.</summary>
        public event Action<Textures> TexturesWanted;

        /// <summary>A frame was not recognised.</summary>
        public event Action<Skipped> Skipped;

        /// <summary>The service refused a message; the error states the reason.</summary>
        public event Action<Error> Refused;

        /// <summary>A part of a message was left out or changed; the rest was accepted.</summary>
        public event Action<LeftOut> LeftOut;

        public event Action<LinkState> StateChanged;

        /// <summary>This scene gained or lost the outputs.</summary>
        public event Action<bool> OwnershipChanged;

        /// <summary>A message could not be sent because of a bug of this client; the link continues or reconnects.</summary>
        public event Action<Exception> Failed;

        /// <summary>Messages dropped because Pump was not called often enough.</summary>
        public long Dropped { get { return inbox.Dropped; } }

        /// <summary>Received messages that could not be decoded.</summary>
        public long Unreadable { get { return Interlocked.Read(ref unreadable); } }

        internal void CountUnreadable()
        {
            Interlocked.Increment(ref unreadable);
        }

        internal void Fail(Exception error)
        {
            Interlocked.CompareExchange(ref failure, error, null);
        }

        internal void Add(ArraySegment<byte> message, Kind kind)
        {
            if (kind == Kind.Ok && message.Count > LongestPlainOk) inbox.Add(message, kind);
            if (kind != Kind.Ok && kind != Kind.Other && kind != Kind.View) inbox.Add(message, kind);
        }

        internal void Pump(LinkState state, bool isOwner, double budgetS)
        {
            double until = Clock.Now + budgetS;
            if (state != reportedState)
            {
                reportedState = state;
                if (StateChanged != null) StateChanged(state);
            }
            if (isOwner != wasOwner)
            {
                wasOwner = isOwner;
                if (OwnershipChanged != null) OwnershipChanged(isOwner);
            }
            Exception pending = Interlocked.Exchange(ref failure, null);
            if (pending != null && Failed != null) Failed(pending);
            ArraySegment<byte> message;
            Kind kind;
            while (inbox.Take(out message, out kind))
            {
                Read(message, kind);
                if (Clock.Now > until) return;
            }
        }

        void Read(ArraySegment<byte> message, Kind kind)
        {
            try
            {
                var reader = new MsgPackReader(message);
                if (kind == Kind.Decision) decision.Read(ref reader, pool);
                else if (kind == Kind.Telemetry) telemetry.Read(ref reader, pool);
                else if (kind == Kind.Skipped) skipped.Read(ref reader, pool);
                else if (kind == Kind.Vibration) vibration.Read(ref reader, pool);
                else if (kind == Kind.Ok) ok.Read(ref reader, pool);
                else if (kind == Kind.Textures) textures.Read(ref reader, pool);
                else error.Read(ref reader, pool);
            }
            catch (WireException)
            {
                CountUnreadable();
                return;
            }
            Raise(kind);
        }

        void Raise(Kind kind)
        {
            if (kind == Kind.Decision && Decided != null) Decided(decision);
            else if (kind == Kind.Telemetry && Measured != null) Measured(telemetry);
            else if (kind == Kind.Skipped && Skipped != null) Skipped(skipped);
            else if (kind == Kind.Vibration && Vibrated != null) Vibrated(vibration);
            else if (kind == Kind.Ok && LeftOut != null && ok.LeftOut != null) ok.LeftOut.ForEach(LeftOut);
            else if (kind == Kind.Textures && TexturesWanted != null) TexturesWanted(textures);
            else if (kind == Kind.Error && Refused != null) Refused(error);
        }
    }
}
