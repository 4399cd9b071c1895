using System;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// A hand or finger that feels. Add it to an object with a trigger collider and a kinematic
    /// Rigidbody, without which physics reports no contact. Collisions become approach, contact, slide
    /// and release. Several hands of one side, for example on each finger, produce one touch.
    /// </summary>
    [DisallowMultipleComponent, DefaultExecutionOrder(100), AddComponentMenu("HapticVLM/Haptic Hand")]
    public sealed class HapticHand : MonoBehaviour
    {
        const float ApproachPeriodS = 0.1f;
        const int MaxNearColliders = 256;

        [SerializeField]
        HandSide hand = HandSide.Right;

        [SerializeField, Tooltip("Gesture of this hand. By Speed: press, tap or strike at contact, then slide.")]
        HandGesture gesture;

        [SerializeField, Range(0f, 0.5f), Tooltip("Distance at which an approach to an object is reported, m; 0: never.")]
        float approachM = 0.4f;

        [SerializeField, Tooltip("Layers of objects that can be felt.")]
        LayerMask touchableLayers = ~0;

        [SerializeField, Range(0f, 50f), Tooltip("Estimated force, in newtons per m/s of the hand, because triggers report none. Adjust it to taste.")]
        float newtonsPerMps = 4f;

        readonly HandMotion motion = new HandMotion();
        Collider[] overlaps = new Collider[32];
        HandGroup group;
        Collider nearCollider;
        Collider pushed;
        double pushN;
        float searchAt;

        /// <summary>Id of the object this hand touches with any finger; null when it touches nothing.</summary>
        public string TouchedObjectId { get { return group == null ? null : group.Touches.ObjectId; } }

        /// <summary>Speed along the touched or nearby object, else through the world, m/s.</summary>
        public double SpeedMps { get { return motion.SpeedMps; } }

        public HandSide Side { get { return hand == HandSide.Left ? HandSide.Left : HandSide.Right; } }

        /// <summary>The gesture of this hand: set Carve while it holds a knife, Swing while it swings a bat.</summary>
        public HandGesture Gesture
        {
            get { return gesture; }
            set { gesture = value; }
        }

        /// <summary>The object this hand holds and swings; its material determines how a swing feels.</summary>
        public HapticObject Swung { get; set; }

        /// <summary>The reason why physics reports no contact of this hand, with the remedy; null if there is none.</summary>
        public string Problem
        {
            get
            {
                var touching = GetComponent<Collider>();
                if (touching == null && GetComponent<Rigidbody>() != null) touching = GetComponentInChildren<Collider>();
                if (touching == null) return "it has no collider: add a Sphere Collider of 2 cm radius and tick Is Trigger";
                var body = GetComponentInParent<Rigidbody>();
                if (body == null) return "it has no Rigidbody, so physics reports no touch: add one and tick Is Kinematic";
                if (body.isKinematic && !touching.isTrigger) return "a kinematic Rigidbody does not collide with static objects: tick Is Trigger on the collider";
                return null;
            }
        }

        internal void Belong(HandSide side)
        {
            hand = side;
        }

        internal HapticObject Near { get; private set; }

        internal double NearM { get; private set; }

        internal int? NearSurface { get; private set; }

        internal double ClosingMps { get; private set; }

        internal double FreeSpeedMps { get { return motion.FreeSpeedMps; } }

        static HapticConnection Link { get { return HapticClient.Active == null ? null : HapticClient.Active.Connection; } }

        void OnEnable()
        {
            group = HandGroup.Of(Side);
            group.Join(this);
            motion.Restart(transform);
        }

        void Start()
        {
            string problem = Problem ?? Surface.Ignored(gameObject.layer);
            if (problem != null) Debug.LogWarning("HapticVLM: the Haptic Hand '" + name + "' feels nothing: " + problem + ".", this);
        }

        void OnDisable()
        {
            ClearNear();
            group.Leave(this, Link);
        }

        void Update()
        {
            motion.Sample(transform);
            EndDestroyed();
            if (group.Touches.IsTouching) ClearNear();
            else if (approachM > 0f) Approach();
            FollowContacts();
            group.Tick(this, Link);
        }

        void OnCollisionEnter(Collision collision)
        {
            Push(collision);
            Begin(collision.collider);
        }

        void OnCollisionStay(Collision collision)
        {
            Push(collision);
        }

        void OnCollisionExit(Collision collision)
        {
            End(collision.collider);
        }

        void OnTriggerEnter(Collider other)
        {
            Begin(other);
        }

        void OnTriggerExit(Collider other)
        {
            End(other);
        }

        void Push(Collision collision)
        {
            pushed = collision.collider;
            pushN = collision.impulse.magnitude / Time.fixedDeltaTime;
        }

        void Begin(Collider other)
        {
            if (!isActiveAndEnabled) return; // the engine reports to disabled components, too
            if ((touchableLayers & 1 << other.gameObject.layer) == 0) return;
            var target = other.GetComponentInParent<HapticObject>();
            if (target == null || !target.isActiveAndEnabled) return;
            motion.Follow(other, transform.position);
            group.UpdateGesture();
            group.Touches.Begin(this, other, target.ObjectId, motion.SpeedMps, ForceOn(other), Link, target.SurfaceAt(other, transform.position));
        }

        void End(Collider other)
        {
            group.Touches.End(this, other, Link);
            if (other == pushed) pushed = null;
            motion.Follow(LastMet(), transform.position);
        }

        void FollowContacts()
        {
            for (int i = 0; i < group.Touches.Count; i++)
            {
                if (!ReferenceEquals(group.Touches.Finger(i), this)) continue;
                var met = (Collider)group.Touches.Met(i);
                HapticObject target = HapticObject.ById(group.Touches.MetId(i));
                int? surface = target == null ? null : target.SurfaceAt(met, transform.position);
                group.Touches.Follow(this, met, motion.SpeedMps, ForceOn(met), surface);
            }
        }

        double ForceOn(Collider other)
        {
            return ReferenceEquals(other, pushed) ? pushN : motion.SpeedMps * newtonsPerMps;
        }

        Collider LastMet()
        {
            for (int i = group.Touches.Count - 1; i >= 0; i--)
            {
                if (ReferenceEquals(group.Touches.Finger(i), this)) return (Collider)group.Touches.Met(i);
            }
            return null;
        }

        /// <summary>Ends contacts with destroyed or disabled colliders, for which physics reports no exit.</summary>
        void EndDestroyed()
        {
            for (int i = group.Touches.Count - 1; i >= 0; i--)
            {
                if (!ReferenceEquals(group.Touches.Finger(i), this)) continue;
                var met = (Collider)group.Touches.Met(i);
                if (met == null || !met.enabled || !met.gameObject.activeInHierarchy) End(met);
            }
        }

        void ClearNear()
        {
            nearCollider = null;
            Near = null;
        }

        void Approach()
        {
            if (Time.unscaledTime >= searchAt)
            {
                searchAt = Time.unscaledTime + ApproachPeriodS;
                FindNearest();
                motion.Follow(nearCollider, transform.position);
            }
            if (nearCollider == null || Near == null || !Near.isActiveAndEnabled) ClearNear();
            else Measure();
        }

        void Measure()
        {
            Vector3 position = transform.position, point;
            if (!Surface.Nearest(nearCollider, position, motion.FreeVelocity, approachM, out point)) return; // keeps the last values
            NearM = (point - position).magnitude;
            ClosingMps = motion.ClosingMps(position, point);
            NearSurface = Near.SurfaceAt(nearCollider, point);
        }

        void FindNearest()
        {
            Vector3 position = transform.position;
            int count = Physics.OverlapSphereNonAlloc(position, approachM, overlaps, touchableLayers);
            if (count == overlaps.Length && count < MaxNearColliders) Array.Resize(ref overlaps, 2 * count);
            ClearNear();
            float least = float.PositiveInfinity;
            for (int i = 0; i < count; i++)
            {
                Vector3 point;
                if (!Surface.Nearest(overlaps[i], position, motion.FreeVelocity, approachM, out point)) continue;
                float distance = (point - position).sqrMagnitude;
                if (distance >= least) continue;
                var candidate = overlaps[i].GetComponentInParent<HapticObject>();
                if (candidate == null || !candidate.isActiveAndEnabled) continue;
                Near = candidate;
                nearCollider = overlaps[i];
                least = distance;
            }
        }
    }
}
