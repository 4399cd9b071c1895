using System;
using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// The connection to the service: opens, greets, tells the scene, sends and receives off the main
    /// thread, and starts over when the link is lost, until Close. No call blocks. Events are raised
    /// by Pump on the thread that calls it; what they carry is used again for the next message.
    /// </summary>
    public sealed class HapticConnection
    {
        const int CloseTimeoutMs = 500;

        static int threads;
        static int sessions;

        readonly ConnectionSettings settings;
        readonly ManualResetEvent closing = new ManualResetEvent(false);
        readonly Dispatcher dispatcher = new Dispatcher();
        readonly Backoff backoff;
        volatile Conversation conversation;
        volatile Link link;
        volatile Welcome welcome;
        volatile string lastError = "";
        volatile int state;
        volatile int openings;
        volatile int session;
        long touchesRefused;

        public readonly Outbox Outbox;

        public HapticConnection(ConnectionSettings settings)
        {
            this.settings = settings;
            Outbox = new Outbox(settings.WantsOutputs);
            backoff = new Backoff(settings.FirstRetryS, settings.LongestRetryS, GetHashCode() ^ Environment.TickCount);
        }

        /// <summary>Threads and receive loops of all connections that have not ended yet.</summary>
        public static int Running { get { return Thread.VolatileRead(ref threads) + Conversation.Running; } }

        public LinkState State { get { return (LinkState)state; } }

        /// <summary>How often a link was made and welcomed.</summary>
        public int Openings { get { return openings; } }

        /// <summary>
        /// Number of the session, from 1: another with every welcome, and no two connections of this
        /// process share one. A new session knows no object and no picture.
        /// </summary>
        public int Session { get { return session; } }

        /// <summary>Whether this scene is felt: one scene owns the outputs of a service.</summary>
        public bool IsOwner { get { return State == LinkState.Ready && Outbox.Ownership.IsOwner; } }

        /// <summary>Why the last link ended or could not be made; empty if none did.</summary>
        public string LastError { get { return lastError; } }

        /// <summary>What the service last said of itself; null before the first welcome.</summary>
        public Welcome Welcome { get { return welcome; } }

        /// <summary>Touches given while there was no link or another scene owned the outputs, and not sent.</summary>
        public long TouchesRefused { get { return Interlocked.Read(ref touchesRefused); } }

        /// <summary>What arrived: events and counts.</summary>
        public Dispatcher Arrivals { get { return dispatcher; } }

        /// <summary>Starts to connect. Once.</summary>
        public void Open()
        {
            state = (int)LinkState.Connecting;
            Interlocked.Increment(ref threads);
            new Thread(Run) { IsBackground = true, Name = "hapticvlm" }.Start();
        }

        /// <summary>Says goodbye, if the link is up, and ends, both on another thread.</summary>
        public void Close()
        {
            closing.Set();
            Outbox.Wake();
        }

        /// <summary>Ends at once, for when the threads are about to be killed anyway.</summary>
        public void Abort()
        {
            Close();
            Link open = link;
            if (open != null) open.Abort();
        }

        /// <summary>Raises the events of what arrived, for at most this long. Main thread.</summary>
        public void Pump(double budgetS = 0.001)
        {
            dispatcher.Pump(State, IsOwner, budgetS);
        }

        /// <summary>
        /// Sends a touch, whose captured_at is of Clock; false if there is no link, or another scene owns
        /// the outputs, which are then asked for. A touch of the past is of no use, so none is kept for
        /// later. A ring full of contacts and releases means that the link is dead: it is given up. Throws WireException when it names no hand or no phase.
        /// </summary>
        public bool Send(ref Touch touch)
        {
            if (touch.Hand == HandName.Other || touch.Phase == Phase.Other)
                throw new WireException("a touch has a hand, left or right, and a phase");
            Conversation with = conversation;
            if (with == null || !Outbox.Ownership.IsOwner)
            {
                if (touch.Phase == Phase.Contact || touch.Phase == Phase.Slide) Outbox.Ownership.AskForTouch(Clock.Now);
                Interlocked.Increment(ref touchesRefused);
                Flush();
                return false;
            }
            touch.ObjectId = WireText.Within(touch.ObjectId, Touch.ObjectIdMaxLength);
            bool isKept = Outbox.Touches.Add(ref touch);
            if (!isKept) with.GiveUp("the service takes no touches");
            Flush();
            return isKept;
        }

        /// <summary>Makes this the newest frame; its id is set here. One thread at a time.</summary>
        public void Send(ref Frame frame)
        {
            frame.Id = Outbox.Ids.Next();
            frame.Write(Outbox.Frames.Begin());
            Outbox.Frames.Publish();
            Flush();
        }

        /// <summary>Rests the outputs at once; goes before everything else.</summary>
        public void Stop(Scope scope)
        {
            Outbox.Stop(scope);
            Flush();
        }

        /// <summary>Sends what can be sent now from this thread, and has the rest sent soon.</summary>
        public void Flush()
        {
            Conversation with = conversation;
            if (with != null) with.SendNow();
            Outbox.Wake();
        }

        void Run()
        {
            try
            {
                while (!closing.WaitOne(0))
                {
                    state = (int)LinkState.Connecting;
                    TryOnce();
                    state = (int)LinkState.Waiting;
                    closing.WaitOne((int)(backoff.Next() * 1000.0));
                }
            }
            finally
            {
                state = (int)LinkState.Closed;
                Interlocked.Decrement(ref threads);
            }
        }

        void TryOnce()
        {
            try
            {
                link = Link.To(settings.Url, settings.ConnectTimeoutMs, closing);
                Converse(new Conversation(link, settings, Outbox, dispatcher));
            }
            catch (LinkException error)
            {
                lastError = error.Message;
            }
            catch (Exception error)
            {
                // A defect of this package must neither end this thread nor, as Mono would, the process.
                lastError = "an error of the client: " + error.Message;
                dispatcher.Fail(error);
            }
            finally
            {
                conversation = null;
                Link open = link;
                link = null;
                if (open != null && closing.WaitOne(0)) open.Close(CloseTimeoutMs);
                else if (open != null) open.Abort();
            }
        }

        void Converse(Conversation with)
        {
            welcome = with.Greet(closing);
            Outbox.Restart(welcome);
            conversation = with;
            session = Interlocked.Increment(ref sessions);
            state = (int)LinkState.Ready;
            openings++;
            backoff.Reset();
            with.SendUntilLost(closing);
        }
    }
}
